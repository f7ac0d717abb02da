//! Graphs as text files: data ages along chains, verdicts, settings as knobs, a system in the
//! middle, and errors with their places.

use ratelab_system::{
    Bound,
    graph_file::{GraphFile, MOST_PARTS, changed, doubted, format::SECTIONS, readings},
};

use crate::support::*;

#[test]
fn the_age_of_a_chain_is_over_time_and_ends_with_the_run() {
    // Read at 50 + 100 k, of the image taken at 100 k; in force from 60 + 100 k on, so 60 to
    // 160 ms old, the first 50 ms of it within the limit; the last one for 40 ms, all within.
    let within = (99.0 * 50.0 + 40.0) / 9_940.0 * 100.0;
    let mean = (99.0 * 110.0 * 100.0 + 80.0 * 40.0) / 9_940.0;
    let wanted = format!(
        "see: data age mean {mean:.1} ms, greatest 160.0 ms, {within:.2} % of the time within \
         110 ms (50 % wanted)"
    );
    let pair = graph_text("pair", "");
    let summary = run_graph(&pair, 10.0, "");
    assert_eq!(chain_lines(&pair, &summary), [wanted]);
    let kept = "KEPT (see at most 110 ms old for 50 % of the time)";
    assert_eq!(summary.verdict.to_string(), kept);
    assert!((summary.latency.mean_s().expect("outputs") - 0.06).abs() < 1e-9);
    let system = graph_system(&pair).expect("a graph");
    let figures = system.judge().finals_at(summary.sim_time, &summary.state);
    assert_eq!(figures[0].name, "see_mean_age");
    let missed = run_graph(&pair, 10.0, "link /image loss:1").verdict;
    assert_eq!(missed.to_string(), "MISSED (no data on chain see)");
    // Shown as it was given, which seconds as a binary fraction are not.
    let odd = run_graph(&pair.replace("age_ms = 110", "age_ms = 4.1"), 1.0, "").verdict;
    let missed = "MISSED (see older than 4.1 ms for more than 50 % of the time)";
    assert_eq!(odd.to_string(), missed);
}

#[test]
fn chains_have_the_ages_that_follow_from_rates_costs_and_triggers() {
    // With a crash: the image of 1.9 s is the last one that came through. In the middle of the
    // cart-pole: sensed at 0, an image at 10, read at 20, a pose at 35, decided and applied at 40.
    // Triggered: out at 60 + 100 k, of the image begun at 100 k; the last one for 40 ms only. A
    // slower detector loses images in its queue, and its ticks are those of the newest kept. The
    // fusion: at 50 both arrive; the slow one is taken first, so the fast one of 40 is the newest.
    // On messages in the middle: an image at 10, a pose at 25, decided at 40, when the actuator has
    // ticked already: executors look last at an instant. Applied at 60. One thread has 20 ms per
    // period for 25 ms of work. A clock in steps of 10 ms shows 30 Hz at 0, 40, 70 and 100 ms, and
    // swallows what is faster.
    check_graphs(
        r#"
        pair         |                           | 10 | takes control none  | see_greatest_age 150.0
        pair         |                           | 10 | rate camera 50      | published /image 500
        pair         |                           | 10 | 2 crash control     | see_greatest_age 8100.0; verdict missed_see
        two-ways     |                           | 10 |                     | by_fast_mean_age 5.0; by_fast_greatest_age 10.0; by_slow_mean_age 500.0; by_slow_greatest_age 1000.0; verdict completed
        circle       |                           | 10 |                     | published /a 0
        middle       |                           | 10 |                     | latency 40; age 50; verdict balanced
        middle       |                           | 10 | takes detector 110  | verdict pole_fell
        middle+blink |                           | 10 |                     | verdict missed_blink
        middle+blink |                           | 10 | takes detector 110  | verdict pole_fell
        middle+blink | age_ms = 100 → age_ms = 600 | 10 |                   | verdict balanced
        triggered    |                           | 10 |                     | see_mean_age 109.9; see_greatest_age 160.0
        triggered    | takes = 30 → takes = 150  | 10 |                     | dropped /image 33; ticks detector 67
        fusion       |                           | 10 |                     | ticks fuse 401; by_fast_greatest_age 35.0; by_slow_greatest_age 25.0; by_map_greatest_age 1000.0
        fusion       | each → exact:10           | 10 |                     | ticks fuse 201; by_fast_greatest_age 50.0
        triggered-middle |                       | 10 |                     | latency 60; verdict balanced
        triggered-middle | multi:3 → single      | 10 |                     | dropped /image 166
        clocked      |                           | 1  |                     | ticks slow 31; ticks fast 101; overruns fast 150; ticks tenth 26; ticks steady 251
        clocked      | rate = 100 → rate = 1000  | 1  |                     | ticks fast 251; overruns fast 0
        clocked      |                           | 1  | rate fast 500       | ticks fast 101; ticks tenth 51
        clocked      |                           | 1  | rate fast 500; rate tenth 5 | ticks tenth 6
        clocked      |                           | 2  | 1 rate fast 500     | ticks tenth 76
        "#,
    );
    let slow = run_graph(&graph_text("middle", ""), 1.0, "takes detector 110");
    assert!(slow.topic("/pose").expect("a topic").is_read());
}

#[test]
fn settings_are_knobs_that_those_of_a_run_replace() {
    let pair = graph_system(&graph_text("pair", "")).expect("a graph");
    let settings = pair.about().setup();
    let knobs: Vec<String> = settings.iter().map(ToString::to_string).collect();
    let expected = "rate camera 10; takes camera 20; rate control 10; offset control 50; \
                    takes control 10";
    assert_eq!(knobs.join("; "), expected);
}

#[test]
fn nodes_that_are_due_together_tick_in_the_order_of_the_file() {
    let source = "[node.source]\nrate = 10\npublishes = [\"/x\"]\n";
    let sink = "[node.sink]\nrate = 10\nreads = [\"/x\"]\n";
    for (nodes, ages) in [
        ([source, sink], "mean 50.0 ms, greatest 100.0 ms"),
        ([sink, source], "mean 150.0 ms, greatest 200.0 ms"),
    ] {
        let chain = "[chain.c]\npath = [\"source\", \"/x\", \"sink\"]\n";
        let text = format!("name = \"two\"\n{}{chain}", nodes.concat());
        let lines = chain_lines(&text, &run_graph(&text, 10.0, ""));
        assert_eq!(lines, [format!("c: data age {ages}")]);
    }
}

#[test]
fn without_nodes_before_the_policy_the_runs_are_those_of_the_system() {
    let alone = "name = \"alone\"\n[system]\nname = \"cart-pole\"\n[node.load]\nrate = 100\n";
    let summary = run_graph(alone, 10.0, "rate policy 5");
    let known = run(&config("control-hz 5"));
    assert_eq!(
        (summary.state, summary.verdict.at),
        (known.state, known.verdict.at)
    );
}

#[test]
fn a_chain_through_a_system_counts_from_the_tick_of_its_first_node() {
    let middle = graph_text("middle", "");
    let chain = |path: &str| format!("{middle}[chain.log]\npath = [{path}]\n");
    for (path, offset, ages) in [
        // An image of 0 ms is there at 10 and logged at 12; then one every 20 ms.
        (
            r#""sensor", "/obs", "camera", "/image", "logger""#,
            0,
            "mean 22.0 ms, greatest 32.0 ms",
        ),
        (
            r#""camera", "/image", "logger""#,
            0,
            "mean 22.0 ms, greatest 32.0 ms",
        ),
        // The reading waits 5 ms for the camera, whose tick begins then.
        (
            r#""sensor", "/obs", "camera", "/image", "logger""#,
            5,
            "mean 32.0 ms, greatest 42.0 ms",
        ),
        (
            r#""camera", "/image", "logger""#,
            5,
            "mean 27.0 ms, greatest 37.0 ms",
        ),
    ] {
        let text = chain(path);
        let summary = run_graph(&text, 10.0, &format!("offset camera {offset}"));
        let lines = chain_lines(&text, &summary);
        assert_eq!(lines, [format!("log: data age {ages}")], "{path}");
    }
    for (path, what) in [
        (
            r#""sensor", "/obs", "camera", "/image""#,
            "log ends at camera",
        ),
        (
            r#""sensor", "/state", "logger""#,
            "no way from sensor to /state",
        ),
    ] {
        let error = graph_system(&chain(path)).err().expect(path);
        assert!(error.what.contains(what), "{error}");
    }
}

#[test]
fn errors_have_a_place_and_a_remedy() {
    let cases = include_str!("../fixtures/graph_errors.txt").split("\n\n");
    let mut count = 0;
    for case in cases.skip(1) {
        let (said, text) = case.split_once('\n').expect("a file");
        let (place, what) = said.split_once(": ").expect("a place");
        let error = graph_system(text).err().expect(case).to_string();
        let rest = error.strip_prefix(&format!("{place}: "));
        let known = rest.is_some_and(|rest| rest.contains(what));
        assert!(known, "{error}, not {case}");
        count += 1;
    }
    assert_eq!(count, 84);
    let large = GraphFile::parse(&"x".repeat(2 << 20)).expect_err("too large");
    let said = "line 1, column 1: 2097152 bytes: expected up to 1048576";
    assert_eq!(large.to_string(), said);
    // A topic that a node misses is none of its own.
    let text = graph_text("circle", "reads = [\"/b\"] → reads = [\"/zz\"]");
    let error = graph_system(&text).err().expect("an error").to_string();
    let other = error.contains("expected /b") && !error.contains("/a");
    assert!(other, "{error}");
}

/// A graph with each kind of node: at a rate and on messages, with a thread of its own and without.
const ALL_KINDS: &str = r#"name = "g"
[node.own]
rate = 50
takes = 3
publishes = ["/a"]
[node.on]
trigger = ["/a"]
publishes = ["/b"]
[node.timer]
rate = 20
reads = ["/a"]
publishes = ["/c"]
[node.both]
trigger = ["/a", "/b"]
[node.job]
rate = 10
deadline_ms = 9
[executor.ros]
kind = "single"
nodes = ["timer", "both"]
[executor.cpu]
kind = "edf:1"
nodes = ["job"]
[topic."/a"]
depth = 2
[topic."/c"]
depth = 2
[chain.c]
path = ["own", "/a", "timer"]
[limit.x]
at_most = 3
"#;

/// Values of all kinds that keys have, and of none.
const VALUES: [&str; 31] = [
    "-1",
    "0",
    "1e300",
    "nan",
    "inf",
    "true",
    "\"\"",
    "\"x y\"",
    "\"/a\"",
    "\"queue:3\"",
    "\"skip\"",
    "\"30 0\"",
    "\"delay:5..40\"",
    "\"oldest\"",
    "\"file:none.csv\"",
    "\"0.5 * file:none.csv\"",
    "\"delay:drawn:none.csv\"",
    "{ \"0.05\" = \"crash own\" }",
    "[]",
    "[1]",
    "[\"x\"]",
    "[\"/c\"]",
    "[\"own\"]",
    "{}",
    "3",
    "0.5",
    "\"job / 3\"",
    "\"exact:0\"",
    "\"let\"",
    "\"multi:2\"",
    "1979-05-27",
];

#[test]
fn whatever_a_key_is_set_to_is_refused_with_its_place_or_runs() {
    let mut refused = 0;
    for section in &SECTIONS {
        let heads: Vec<&str> = ALL_KINDS
            .lines()
            .filter(|line| match section.name {
                "" => line.starts_with("name"),
                name => line.starts_with(&format!("[{name}")),
            })
            .collect();
        for (head, key) in heads
            .iter()
            .flat_map(|head| section.keys.iter().map(move |key| (head, key)))
        {
            for value in VALUES {
                let text = with_key(head, key.name, value);
                let wrong = match graph_system(&text) {
                    Err(error) => Some(error),
                    Ok(_) => {
                        let system = GraphFile::parse(&text).expect("parsed").system(&[]);
                        system.expect("a system").check_settings().err()
                    }
                };
                if let Some(error) = wrong {
                    let line = text.lines().nth(error.line - 1);
                    let length = line.map_or(0, |line| line.chars().count());
                    assert!(error.column <= length + 1, "{error}\n{text}");
                    refused += 1;
                    continue;
                }
                let system = graph_system(&text).expect("a system");
                let built = Experiment::new(system, &config("until 0.1"));
                assert!(built.is_ok(), "{:?} has no place in\n{text}", built.err());
            }
        }
    }
    assert!(refused > 500, "{refused}");
}

/// The graph of all kinds with a key below its `head`, in place of the same key there.
fn with_key(head: &str, key: &str, value: &str) -> String {
    let new = format!("{key} = {value}");
    let mut lines: Vec<&str> = ALL_KINDS.lines().collect();
    let place = lines.iter().position(|line| *line == head).expect("a head");
    if !head.starts_with('[') {
        lines[place] = &new;
        return lines.join("\n");
    }
    let end = lines
        .iter()
        .skip(place + 1)
        .position(|line| line.starts_with('['));
    let end = end.map_or(lines.len(), |end| place + 1 + end);
    let same = (place..end).find(|line| lines[*line].split(' ').next() == Some(key));
    match same {
        Some(same) => lines[same] = &new,
        None => lines.insert(place + 1, &new),
    }
    lines.join("\n")
}

#[test]
fn graphs_up_to_the_limit_run_and_larger_ones_are_refused() {
    let graph = |nodes: usize| {
        let nodes = (0..nodes).map(|node| format!("[node.n{node}]\nrate = 10\n"));
        format!("name = \"many\"\n{}", nodes.collect::<String>())
    };
    let summary = run_graph(&graph(MOST_PARTS), 1.0, "");
    assert_eq!(summary.nodes.len(), MOST_PARTS);
    let error = GraphFile::parse(&graph(10_000)).expect_err("too large");
    assert!(error.what.contains("10000 parts"), "{error}");
}

#[test]
fn a_change_sets_its_keys_and_a_trigger_stands_in_place_of_a_rate() {
    let text = "name = 'g'\n[node.z]\nrate = 5\nreads = ['/b', '/c']\n[node.a]\nrate = 7\n";
    let change = "node.z.trigger = ['/b']\ntopic.'/b'.depth = 2";
    let text_of = |text: &str, change: &str| changed(text, change).expect("TOML").text;
    assert_eq!(
        text_of(text, change),
        "name = \"g\"\n\n[node.z]\nreads = [\"/c\"]\ntrigger = [\"/b\"]\n\n[node.a]\nrate = 7\n\n\
         [topic.\"/b\"]\ndepth = 2\n"
    );
    // And the other way round: what triggered the node is read.
    let triggered = text_of(text, change);
    let timed = text_of(&triggered, "node.z.rate = 8");
    let node = "[node.z]\nreads = [\"/b\", \"/c\"]\nrate = 8\n";
    assert!(timed.contains(node), "{timed}");
    let bound = "name = 'g'\nlimit.x.at_most = 3\n";
    let other = text_of(bound, "limit.x.at_least = 2");
    assert!(!other.contains("at_most"), "{other}");
    assert!(changed(text, "node.z").is_err());
    let unknown = changed(text, "node.x.rate = 5");
    let unknown = unknown.expect_err("no node").to_string();
    assert_eq!(unknown, "the file has no node \"x\"");
}

#[test]
fn a_change_names_the_keys_that_it_leaves_out() {
    let timed = "node.z = { rate = 5, offset = 2, late = 'queue:3', reads = ['/b'] }";
    let changed_to = |text, change| changed(text, change).expect("TOML");
    let triggered = changed_to(timed, "node.z.trigger = ['/b']");
    assert_eq!(
        triggered.left_out,
        [
            "node.z.rate = 5",
            "node.z.offset = 2",
            "node.z.late = \"queue:3\""
        ]
    );
    let matched = changed_to(&triggered.text, "node.z.match = 'exact'");
    assert!(matched.left_out.is_empty());
    let timed = changed_to(&matched.text, "node.z.rate = 5");
    assert_eq!(
        timed.left_out,
        ["node.z.match = \"exact\"", "node.z.trigger = [\"/b\"]"]
    );
    let bounded = changed_to("limit.x.at_most = 3", "limit.x.at_most = 4");
    assert!(bounded.left_out.is_empty());
}

#[test]
fn keys_that_graphs_of_bags_need_do_what_they_say() {
    // A message every 100 ms; every third one, from the first on; of 20 looks a second those that
    // find another one; and a crash from the file, whose time the program passes on.
    let text = |keys: &str| {
        format!(
            "name = 'g'\n[node.a]\nrate = 10\npublishes = ['/a']\n[node.b]\n{keys}\n\
             publishes = ['/b']\n[at]\n'0.5' = ['crash a', 'restart a']\n"
        )
    };
    for (keys, published) in [
        ("trigger = ['/a']", 10),
        ("trigger = ['/a']\nevery = 3", 4),
        ("trigger = ['/a']\nevery = 1", 10),
        ("rate = 20\noffset = 5\nreads = ['/a']", 20),
        ("rate = 20\noffset = 5\nreads = ['/a']\nonly_new = true", 10),
        (
            "rate = 20\noffset = 5\nreads = ['/a']\nonly_new = false",
            20,
        ),
    ] {
        let text = text(keys);
        let summary = run_graph(&text, 0.999, "");
        let topic = summary.topics.iter().find(|topic| &*topic.name == "/b");
        assert_eq!(topic.expect("a topic").published, published, "{keys}");
        let system = graph_system(&text).expect("a graph");
        let events: Vec<String> = system
            .about()
            .events
            .iter()
            .map(|timed| format!("{} {}", timed.at.as_secs_f64(), timed.knob))
            .collect();
        assert_eq!(events, ["0.5 crash a", "0.5 restart a"]);
    }
}

#[test]
fn a_figure_at_its_bound_is_within_it_however_its_sums_are_rounded() {
    for (bound, value, holds) in [
        (Bound::AtMost(26.2), 26.2, true),
        (Bound::AtMost(26.2), 26.200_000_000_000_003, true),
        (Bound::AtMost(26.2), 26.200_000_000_01, false),
        (Bound::AtLeast(0.9), 0.899_999_999_999_999_9, true),
        (Bound::AtLeast(0.9), 0.899_999_999_99, false),
        (Bound::AtMost(-61.2), -61.199_999_999_999_996, true),
        (Bound::AtMost(0.0), 0.0, true),
        (Bound::AtMost(0.0), f64::MIN_POSITIVE, false),
        (Bound::AtMost(0.0), f64::NAN, false),
        (Bound::AtLeast(1e12), 1e12 - 1.0, false),
    ] {
        assert_eq!(bound.holds(value), holds, "{bound:?} {value}");
    }
}

/// The graph of a bag that does not tell a timer from a trigger.
const OPEN: &str = r#"
    name = "a"
    [node.cam]
    rate = 10
    offset = 5
    [node.n]
    trigger = ["/cam"]
    takes = 30
    or = ["rate = 20, offset = 3, takes = 10", "only_new = true"]
    [node.m]
    trigger = ["/n"]
    [topic."/n"]
    depth = 1
"#;

#[test]
fn a_change_has_the_readings_phases_and_queues_that_the_bag_did_not_show() {
    let with = |now: &str| -> Vec<String> {
        let all = readings(OPEN, now).into_iter();
        all.map(|reading| reading.with.join("; ")).collect()
    };
    let timer = r#"node."n" = { rate = 20, offset = 3, takes = 10 }"#;
    let silent = r#"node."n" = { only_new = true }"#;
    let queues = r#"topic."/cam".depth = 10"#;
    assert_eq!(with(OPEN), [timer, silent, queues]);
    let faster = with(&OPEN.replace("rate = 10", "rate = 20.0"));
    let phases = ["13.500000", "19.000000", "24.000000", "42.000000"];
    let phases = phases.map(|ms| format!(r#"node."cam".offset = {ms}"#));
    assert_eq!((faster.len(), &faster[2..6]), (7, &phases[..]));
    assert_eq!(doubted(OPEN, OPEN), [""; 0]);
    let as_timer = OPEN.replace(r#"trigger = ["/cam"]"#, "rate = 40");
    assert_eq!(doubted(OPEN, &as_timer), ["n"]);
}

#[test]
fn a_change_of_what_only_another_reading_has_is_one_of_that_reading() {
    let node = |change: &str| {
        let file = changed(OPEN, change).expect("a change").text;
        file.split("[node.n]").nth(1).unwrap_or_default().to_owned()
    };
    let faster = node("node.n.rate = 40");
    for part in [
        "takes = 10\n",
        "offset = 3\n",
        r#"or = ["takes = 30", "only_new = true"]"#,
    ] {
        assert!(faster.contains(part), "{part}: {faster}");
    }
    // In place of a timer, which it must have been.
    let triggered = node(r#"node.n.trigger = ["/cam"]"#);
    for part in ["takes = 10\n", r#"or = ["takes = 30"]"#] {
        assert!(triggered.contains(part), "{part}: {triggered}");
    }
    let quicker = node("node.n.takes = 15");
    assert!(quicker.contains("takes = 5.0"), "{quicker}");
}
