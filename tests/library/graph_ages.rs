//! The parts of the age of a chain in graphs with triggers and executors.

use ratelab::Time;
use ratelab_account::{AgeStage, Lineage};
use ratelab_study::experiment::{Config, Experiment};

use crate::{graph_file::system, support::secs};

/// More than any topic or node here publishes or ticks.
const ROOM: usize = 20_000;

/// A pair of cameras before a pose, a filter with a rate of its own, and a load beside them.
fn pair(matching: &str, executor: &str, more: &str) -> String {
    let nodes =
        "[\"left-camera\", \"right-camera\", \"stereo\", \"filter\", \"load\", \"control\"]";
    let executor = match executor {
        "" => String::new(),
        kind => format!("[executor.one]\nkind = \"{kind}\"\nnodes = {nodes}\n"),
    };
    let text = format!(
        r#"
name = "pair"
[node.clock]
rate = 20
publishes = ["/tick"]
[node.left-camera]
trigger = ["/tick"]
takes = 4
publishes = ["/left"]
[node.right-camera]
trigger = ["/tick"]
takes = "2..19"
publishes = ["/right"]
[node.stereo]
trigger = ["/left", "/right"]
match = "{matching}"
takes = 7
publishes = ["/pose"]
[node.filter]
rate = 30
takes = 3
reads = ["/pose"]
publishes = ["/state"]
[node.load]
rate = 15
takes = "5..12"
[node.control]
trigger = ["/state"]
takes = 1
publishes = ["/cmd"]
{executor}
{more}
[chain.see]
path = ["clock", "/tick", "left-camera", "/left", "stereo", "/pose", "filter", "/state", "control", "/cmd"]
age_ms = 90
[chain.right]
path = ["clock", "/tick", "right-camera", "/right", "stereo", "/pose", "filter", "/state", "control", "/cmd"]
"#
    );
    match executor.contains("edf") {
        true => text.replace("trigger =", "deadline_ms = 50\ntrigger ="),
        false => text,
    }
}

/// The lineage of a run of five seconds, the node that acts, and the mean age (ns) over its
/// pushes.
fn played(text: &str) -> (Lineage, usize, f64) {
    let system = system(text).unwrap_or_else(|error| panic!("{error}: {text}"));
    let config = Config {
        end: secs(5.0),
        ..Config::default()
    };
    let experiment = Experiment::new(system.clone(), &config).expect("a graph");
    let (observer, taps) = (experiment.observer(), experiment.taps());
    let topology = observer.topology();
    let mut lineage = Lineage::new(topology.clone()).along(system.about().latency_path);
    let settings = system.about().settings;
    settings
        .iter()
        .for_each(|knob| lineage.knob(Time::ZERO, knob));
    let ticks = taps.ticks(ROOM);
    let names = topology.topics.iter();
    let rows: Vec<_> = names.map(|topic| taps.rows(&topic.name, ROOM)).collect();
    experiment.run().expect("no fault");
    for (topic, tap) in rows.iter().enumerate() {
        let Some(tap) = tap else { continue };
        let mut rows = tap.rows();
        tap.take(&mut rows);
        let heads = rows.heads().iter();
        heads.for_each(|head| lineage.message(topic, head));
    }
    for (node, ticks) in ticks.iter().enumerate() {
        let ticks = ticks.items().try_iter();
        ticks.for_each(|tick| lineage.tick(node, tick));
    }
    lineage.settle();
    let (acts, _) = system.latency().expect("a chain");
    let mut nodes = topology.nodes.iter();
    let acts = nodes.position(|node| node.name == acts).expect("a node");
    let snapshot = observer.snapshot();
    let age = snapshot.nodes[acts].push_age.view(snapshot.now);
    let age = age.expect("pushes");
    (lineage, acts, age.mean_s().expect("some time") * 1e9)
}

/// Checks that the parts of the ages in a run sum to them.
fn sums_are_exact(text: &str) {
    let (lineage, acts, mean) = played(text);
    let ticks = lineage.ticks(acts).map(|worked| worked.tick);
    let pushes = ticks.filter_map(|tick| tick.push.zip(tick.ends));
    let mut count = 0;
    for (push, at) in pushes {
        let known = lineage
            .push_at(acts, at)
            .unwrap_or_else(|| panic!("no push at {at}: {text}"));
        let parts = known.parts(at);
        let age = i128::from(at.as_nanos()) - i128::from(push.sensed.as_nanos());
        assert_eq!(
            i128::from(parts.sum_ns()),
            age,
            "at {at}: {parts:?}\n{text}"
        );
        assert_eq!(parts.before_ns, 0, "at {at}: {parts:?}\n{text}");
        count += 1;
    }
    assert!(count >= 20, "only {count} pushes: {text}");
    let parts = lineage.mean_parts(acts, lineage.first_push(acts), secs(5.0));
    let sum: f64 = parts.iter().map(|(_, ns)| ns).sum();
    assert!(
        (sum - mean).abs() <= 1.0,
        "mean {mean}, parts {sum}: {text}"
    );
}

const MATCHES: [&str; 3] = ["each", "exact:10", "approximate:10"];

const EXECUTORS: &[&str] = &[
    "",
    "single",
    "multi:2",
    "events",
    "fixed-priority:1",
    "edf:1",
    "fixed-priority:2",
];

#[test]
fn the_parts_of_the_age_of_a_chain_sum_to_it_whatever_triggers_and_executes_its_nodes() {
    for matching in MATCHES {
        for executor in EXECUTORS {
            for more in ["", "[topic.\"/left\"]\nlink = \"delay:0..30\"\ndepth = 3\n"] {
                sums_are_exact(&pair(matching, executor, more));
            }
        }
    }
}

#[test]
fn a_message_waits_for_its_partner_and_the_set_for_the_executor() {
    let text = r#"
name = "pair"
[node.clock]
rate = 10
publishes = ["/tick"]
[node.left]
trigger = ["/tick"]
takes = 5
publishes = ["/left"]
[node.right]
trigger = ["/tick"]
takes = 30
publishes = ["/right"]
[node.load]
rate = 10
offset = 25
takes = 15
[node.stereo]
trigger = ["/left", "/right"]
match = "exact:10"
takes = 8
publishes = ["/pose"]
[executor.one]
kind = "single"
nodes = ["load", "stereo"]
[chain.see]
path = ["clock", "/tick", "left", "/left", "stereo", "/pose"]
"#;
    let (lineage, acts, _) = played(text);
    // The left image is there at 5 ms, the right one at 30, the thread is free at 40.
    let at = secs(0.148);
    let parts = lineage.push_at(acts, at).expect("a push").parts(at);
    assert_eq!(
        parts.sentence(lineage.topology()),
        "this push is 48 ms old: 5 in the left + 25 waiting for /right to match + 10 waiting for \
         the executor of the stereo + 8 in the stereo"
    );
    let matches = parts.parts.iter();
    let matches = matches.filter(|part| matches!(part.stage, AgeStage::Match { .. }));
    assert_eq!(matches.count(), 1);
    let ms = |ms: u64| Time::from_nanos(ms * 1_000_000);
    let ticks = lineage.ticks_between(acts, ms(100), ms(148));
    let (last, _) = ticks.last().expect("a tick");
    let matched = lineage.waited_for_match(acts, last).expect("a wait");
    assert_eq!((matched.from, matched.to), (ms(105), ms(130)));
    assert_eq!(lineage.topology().topics[matched.topic].name, "/right");
    let executed = lineage.waited(acts, last).expect("a wait");
    assert_eq!((executed.from, executed.to), (ms(130), ms(140)));
}

#[test]
fn the_parts_sum_to_the_age_where_images_of_other_times_meet() {
    for matching in ["each", "approximate:10"] {
        for executor in EXECUTORS {
            let text = pair(matching, executor, "[topic.\"/left\"]\ndepth = 3\n");
            // A camera at a rate of its own.
            let (before, right) = text.split_once("[node.right-camera]").expect("a camera");
            let right = right.replacen("trigger = [\"/tick\"]", "rate = 31", 1);
            let text = format!("{before}[node.right-camera]{right}");
            let from = "path = [\"clock\", \"/tick\", \"right-camera\"";
            sums_are_exact(&text.replace(from, "path = [\"right-camera\""));
        }
    }
}
