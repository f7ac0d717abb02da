//! The parts of the age of a chain in graphs with triggers and executors.

use crate::support::*;

/// The lineage of a run of five seconds, the node that acts, and the mean age (ns) over its
/// pushes.
fn played(text: &str) -> (Lineage, usize, f64) {
    let system = graph_system(text).unwrap_or_else(|error| panic!("{error}: {text}"));
    let experiment = Experiment::new(system.clone(), &config("until 5")).expect("a graph");
    let (observer, taps) = (experiment.observer(), experiment.taps());
    let topology = observer.topology();
    let lineage = Lineage::new(topology.clone(), system.about().settings);
    let mut lineage = lineage.along(system.about().latency_path());
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
    let lineage = settled(lineage, &ticks);
    let acts = acting_node(&*system, &topology).expect("a chain");
    let snapshot = observer.snapshot();
    let age = snapshot.nodes[acts].push_age.saw().expect("pushes");
    let mean = age.mean_s(snapshot.now).expect("some time") * 1e9;
    (lineage, acts, mean)
}

/// Checks that the parts of the ages in a run sum to them.
fn sums_are_exact(text: &str) {
    let (lineage, acts, mean) = played(text);
    let ticks = lineage.ticks(acts).map(|worked| worked.tick.clone());
    let pushes = ticks.filter_map(|tick| tick.push.zip(tick.ends));
    let mut count = 0;
    for (push, at) in pushes {
        let known = lineage.push_at(acts, at);
        let known = known.unwrap_or_else(|| panic!("no push at {at}: {text}"));
        let parts = known.parts(at);
        let age = i128::from(at.as_nanos()) - i128::from(push.sensed.as_nanos());
        let sum = i128::from(parts.sum_ns());
        assert_eq!(
            (sum, parts.before_ns),
            (age, 0),
            "at {at}: {parts:?}\n{text}"
        );
        count += 1;
    }
    assert!(count >= 20, "only {count} pushes: {text}");
    let parts = mean_parts(
        &lineage,
        acts,
        TimeSpan::new(lineage.first_push(acts), secs(5.0)),
    );
    let sum: f64 = parts.iter().map(|(_, ns)| ns).sum();
    let apart = (sum - mean).abs();
    assert!(apart <= 1.0, "mean {mean}, parts {sum}: {text}");
}

const EXECUTORS: [&str; 7] = [
    "",
    "single",
    "multi:2",
    "events",
    "fixed-priority:1",
    "edf:1",
    "fixed-priority:2",
];

/// The pair of cameras, matched and executed as named, with more settings and changes.
fn stereo(matching: &str, executor: &str, more: &str, changes: &str) -> String {
    let deadlines = if executor.contains("edf") {
        "trigger = → deadline_ms = 50\ntrigger ="
    } else {
        ""
    };
    let text = graph_text(
        "stereo",
        &format!("each → {matching}; {deadlines}; {changes}"),
    );
    let executor = match executor {
        "" => String::new(),
        kind => format!(
            "[executor.one]\nkind = \"{kind}\"\nnodes = [\"left-camera\", \"right-camera\", \
             \"stereo\", \"filter\", \"load\", \"control\"]\n"
        ),
    };
    format!("{text}{executor}{more}")
}

#[test]
fn the_parts_of_the_age_of_a_chain_sum_to_it_whatever_triggers_and_executes_its_nodes() {
    let shallow = "[topic.\"/left\"]\ndepth = 3\n";
    let delayed = format!("{shallow}link = \"delay:0..30\"\n");
    // Images of other times meet where a camera has a rate of its own.
    let own_rate = "trigger = [\"/tick\"]\ntakes = \"2..19\" → rate = 31\ntakes = \"2..19\"; \
                    [\"clock\", \"/tick\", \"right-camera\" → [\"right-camera\"";
    for executor in EXECUTORS {
        for matching in ["each", "exact:10", "approximate:10"] {
            sums_are_exact(&stereo(matching, executor, "", ""));
            sums_are_exact(&stereo(matching, executor, &delayed, ""));
        }
        for matching in ["each", "approximate:10"] {
            sums_are_exact(&stereo(matching, executor, shallow, own_rate));
        }
    }
}

#[test]
fn a_message_waits_for_its_partner_and_the_set_for_the_executor() {
    let (lineage, acts, _) = played(&graph_text("partners", ""));
    let at = secs(0.148);
    let parts = lineage.push_at(acts, at).expect("a push").parts(at);
    let topology = lineage.topology();
    let told = parts.parts.iter();
    let told = told.map(|part| {
        let owner = part.stage.owner(topology);
        (part.stage.key(), owner, part.took.as_millis())
    });
    assert_eq!(
        told.collect::<Vec<_>>(),
        [
            ("cost", "left", 5),
            ("match", "/right", 25),
            ("executor", "stereo", 10),
            ("cost", "stereo", 8)
        ]
    );
    let ticks = lineage.ticks_within(acts, TimeSpan::new(at_ms(100), at_ms(148)));
    let (last, _) = ticks.last().expect("a tick");
    let waits = lineage.waits(acts, last);
    let [matched, executed] = waits[..] else {
        panic!("{waits:?}");
    };
    assert_eq!((matched.from, matched.to), (at_ms(105), at_ms(130)));
    let right = lineage.topology().topic("/right");
    assert_eq!(Some(matched.what), right.map(WaitsFor::Match));
    assert_eq!((executed.from, executed.to), (at_ms(130), at_ms(140)));
    assert!(matches!(executed.what, WaitsFor::Node(_)));
}

/// The summary of a run with its ages, of the graph in `text`.
fn with_ages(text: &str, until: &str) -> Summary {
    let system = graph_system(text).unwrap_or_else(|error| panic!("{error}: {text}"));
    let mut experiment = Experiment::new(system, &config(until)).expect("a graph");
    experiment.watch_ages();
    experiment.run().expect("no fault")
}

#[test]
fn the_parts_of_an_age_over_a_whole_run_sum_to_it_for_every_chain() {
    // Long enough to be counted in several batches.
    for name in ["robot", "autoware", "starving-subscription", "half-idle"] {
        let text = graph_text(name, "");
        let summary = with_ages(&text, "until 60");
        let system = graph_system(&text).expect("a graph");
        for chain in system.about().chains {
            let mut ages = summary.ages.iter();
            let age = ages.find(|age| age.chain.as_deref() == Some(chain.name()));
            let figure = chain.mean_ms(summary.sim_time, &summary.chains);
            assert_eq!(age.is_none(), figure.is_none(), "{name}: {}", chain.name());
            let Some((age, figure)) = age.zip(figure) else {
                continue;
            };
            let sum: i64 = age.parts.iter().map(|part| part.ns).sum();
            assert_eq!(sum, age.mean_ns, "{name}: {age:?}");
            let apart = (age.mean_ns as f64 - figure * 1e6).abs();
            assert!(apart < 2.0, "{name}: {age:?}, measured {figure} ms");
            let mut stages = age.parts.iter().map(|part| part.stage);
            assert!(stages.all(|stage| stage != AgeStage::Before), "{age:?}");
        }
    }
}

#[test]
fn an_age_over_a_run_names_who_it_is_due_to_and_its_99th_percentile() {
    let text = "name = 'two'\n[node.camera]\nrate = 10\ntakes = 20\npublishes = ['/image']\n\
                [node.control]\nrate = 10\noffset = 50\nreads = ['/image']\n\
                [chain.see]\npath = ['camera', '/image', 'control']\n";
    let summary = with_ages(text, "until 20.05");
    let [age] = &summary.ages[..] else {
        panic!("{:?}", summary.ages)
    };
    // From 50 to 150 ms old, all the time.
    assert_eq!((age.mean_ns, age.p99_ns), (100_000_000, 149_000_000));
    let parts = age.parts.iter();
    let parts: Vec<_> = parts
        .map(|part| (part.stage.key(), &*part.owner, part.ns / 1_000_000))
        .collect();
    let expected = [
        ("hold", "/image", 45),
        ("wait", "control", 34),
        ("cost", "camera", 20),
    ];
    assert_eq!(parts, expected);
}
