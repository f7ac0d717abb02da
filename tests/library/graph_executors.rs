//! Graph files with executors: known systems with the figures that their sources give, and
//! overloads.

use crate::{support::*, table::rows};

/// The Autoware reference system with all nodes in one executor, and with another cost.
fn autoware(kind: &str, ms: f64) -> String {
    let text = graph_text("autoware", &format!("takes = 5 → takes = {ms}"));
    let (nodes, _) = text.split_once("[executor.front]").expect("executors");
    format!("{nodes}[executor.all]\nkind = \"{kind}\"\n")
}

#[test]
fn the_starving_nodes_of_rclcpp_starve_with_the_threads_of_their_reports_only() {
    // Of issues 2645, 2360, 2912 and 2402, and a timer on two threads that are not full.
    check_graphs(
        r#"
        starving-subscription |                  | 0.9995 | | ticks s2 200; ticks s1 0; published /t1 999; dropped /t1 899; verdict silent_first
        starving-subscription | multi:2 → single | 0.9995 | | ticks s2 100; ticks s1 100; verdict kept
        starving-timer        |                  | 1.005  | | ticks a 100; ticks b 0
        starving-timer        | multi:2 → single | 1.005  | | ticks a 50; ticks b 50
        half-idle             |                  | 6.6    | | ticks t4 0
        half-idle             | multi:2 → multi:1 | 6.6   | | ticks t4 3
        half-idle             | multi:2 → multi:3 | 6.6   | | ticks t4 6
        heavy-and-light       |                   | 10    | | ticks heavy 667; ticks light 333
        heavy-and-light       | "heavy", "light" → "light", "heavy" | 10 | | ticks heavy 667; ticks light 667
        heavy-and-light       | single → multi:2  | 10    | | ticks heavy 667; ticks light 0
        slow-timer            |                   | 10    | | ticks points 2; ticks odom 5; verdict missed_cloud
        slow-timer            | multi:4 → single  | 10    | | ticks points 43; ticks odom 46; verdict kept
        "#,
    );
}

#[test]
fn nodes_that_tick_together_read_in_the_order_of_the_instant() {
    // Timers of executors come first, then threads by priority, then the picks of executors. A tick
    // that waited for the one before has no other place than one that is due or wakes then.
    check_graphs(
        r#"
        filter |                                   | 10 | | sense_mean_age 15.0
        filter | single → events                   | 10 | | sense_mean_age 15.0
        filter | single → multi:2                  | 10 | | sense_mean_age 15.0
        filter | single → fixed-priority:1         | 10 | | sense_mean_age 5.0
        filter | single → fixed-priority:1; "filter", "control" → "control", "filter" | 10 | | sense_mean_age 5.0
        filter | single → fixed-priority:1; [node.filter] → [node.filter]\npriority = 9 | 10 | | sense_mean_age 15.0
        filter | single → edf:1; [node.filter] → [node.filter]\ndeadline_ms = 9 | 10 | | sense_mean_age 5.0
        filter | single → edf:1; [node.filter] → [node.filter]\ndeadline_ms = 11 | 10 | | sense_mean_age 15.0
        filter | "filter", "control" → "control"   | 10 | | sense_mean_age 5.0
        filter | "filter", "control" → "filter"    | 10 | | sense_mean_age 15.0
        behind |                                   | 10 | 0 hang control 40 | sense_mean_age 30.0
        behind | late = "catch-up" → late = "queue:2" | 10 | 0 hang control 40 | sense_mean_age 30.0
        behind | [node.sensor] → [node.sensor]\npriority = 9 | 10 | 0 hang control 40 | sense_mean_age 50.0
        behind | late = "catch-up" → late = "skip" | 10 | wakes control 20 | sense_mean_age 40.0
        behind | late = "catch-up" → late = "skip"; [node.sensor] → [node.sensor]\npriority = 9 | 10 | wakes control 20 | sense_mean_age 60.0
        "#,
    );
}

#[test]
fn the_three_servos_miss_the_deadlines_that_are_documented() {
    let done = |kind: &str| {
        let text = graph_text("three-servos", &format!("fixed-priority:1 → {kind}"));
        let summary = run_graph(&text, 1.0, "");
        ["servo1", "servo2", "servo3"].map(|node| {
            let response = &summary.node(node).expect("a node").response;
            let ms = |share| response.quantile(share).expect("a tick").as_secs_f64() * 1e3;
            (response.count(), ms(0.0).round(), ms(1.0).round())
        })
    };
    // Rate monotonic: the first servo answers after 20 ms or more, the others in time.
    let [first, second, third] = done("fixed-priority:1");
    assert_eq!((first.0, first.1), (50, 20.0));
    assert_eq!((second.0, second.2, third.0, third.2), (200, 4.0, 250, 2.0));
    // Earliest deadline first: all of them are late, more and more.
    let late = done("edf:1");
    assert_eq!(late.map(|(count, _, _)| count), [135, 162, 203]);
    assert!(late.iter().all(|(_, _, most)| *most > 150.0));
}

#[test]
fn the_hot_path_of_autoware_takes_four_steps_with_threads_enough_and_five_with_one() {
    // To the end of the last node: a step more than to its start.
    let steps = |text: &str| {
        let latency = run_graph(text, 60.0, "").latency;
        [0.0, 1.0].map(|share| latency.quantile(share).expect("data").as_secs_f64() * 200.0)
    };
    let close = |a: f64, b: f64| (a - b).abs() < 0.1;
    let [least, most] = steps(&autoware("multi:4", 5.0));
    assert!(close(least, 5.0) && close(most, 5.0), "{least} {most}");
    let [least, _] = steps(&autoware("single", 5.0));
    assert!(least > 5.9, "{least}");
    let [least, most] = steps(&graph_text("autoware", ""));
    assert!(close(least, 5.0) && most < 6.1, "{least} {most}");
}

fn warnings(text: &str, knobs: &str) -> Vec<String> {
    let system = graph_system(text).expect(text);
    let setup = system.about().setup();
    let knobs = knobs.split(';').filter(|text| !text.is_empty()).map(knob);
    system.warnings(&knobs.fold(setup, Setup::with))
}

#[test]
fn one_thread_has_enough_time_for_autoware_up_to_5_26_ms_per_step() {
    assert_eq!(warnings(&autoware("single", 5.26), ""), [""; 0]);
    let warned = warnings(&autoware("single", 10.0), "");
    let said = "executor all is overloaded: its nodes need 190 % of a core, and \
                it has 100 %, so they wait, skip periods or lose messages";
    assert_eq!(warned, [said]);
    for (ms, drops) in [(5.2, false), (10.0, true)] {
        let summary = run_graph(&autoware("single", ms), 60.0, "");
        let hot = ["/FrontLidarDriver", "/RearLidarDriver"];
        let dropped: u64 = hot
            .iter()
            .map(|topic| summary.topic(topic).expect(topic).dropped())
            .sum();
        assert_eq!(dropped > 0, drops, "{ms} ms");
    }
}

#[test]
fn overloads_and_idle_settings_are_known_before_the_run() {
    // Each row has a part of every warning.
    for [name, changes, knobs, parts] in rows(
        r"
        pair             |                  |                  |
        pair             |                  | takes camera 120 | 120 ms at 10 Hz is 120 %
        half-idle        |                  |                  |
        starving-timer   |                  |                  | group timers of executor ros
        three-servos     |                  |                  | need 123 % of a core, and it has 100 %
        two-sources      |                  |                  | c is overloaded: 20 ms at 60 Hz is 120 %
        two-sources      |                  |                  | messages will wait and be dropped
        triggered-middle | multi:3 → single |                  | 125 % of a core
        plan             |                  |                  |
        plan             |                  | takes plan 60..110;rate plan 11.7 | 49 % of its ticks take longer than the period of 85.5 ms, so it will skip 33 % of its periods
        plan             |                  | takes plan 60..110;rate plan 9.2  |
        plan             |                  | takes plan 60..110;rate plan 9    |
        plan             |                  | takes plan 60..110;rate plan 12.5 | 85 ms at 12.5 Hz is 106 % of its time
        plan             |                  | takes plan lognormal:60,100 |
        plan             |                  | takes plan lognormal:60,200 | 16 % of its ticks take longer than the period of 100.0 ms
        plan             |                  | takes plan 100   |
        plan             |                  | takes plan 101   | 101 ms at 10 Hz is 101 % of its time
        idle             |                  |                  | group of a has no effect: executor fixed-priority:1 has no groups; single, multi and events have\ndeadline_ms of a has no effect: executor fixed-priority:1 has none; edf has
        idle             | fixed-priority:1 → single |         | deadline_ms of a
        ",
    ) {
        let case = format!("{name} {changes} {knobs}");
        let found = warnings(&graph_text(&name, &changes), &knobs);
        let parts: Vec<&str> = parts.lines().collect();
        assert_eq!(found.len(), parts.len(), "{case}: {found:?}");
        for (warning, part) in found.iter().zip(parts) {
            assert!(warning.contains(part), "{case}: {warning}");
            let skips = name == "plan";
            assert!(
                !skips || warning.contains("skip") && warning.contains("% of its periods"),
                "{warning}"
            );
        }
    }
}

#[test]
fn a_message_that_triggers_a_tick_is_the_next_one_there_once() {
    let words = Topic::new("/words", Depth::new(4).expect("a depth"));
    let mut graph = Graph::new();
    let publisher = words.publisher();
    worker(&mut graph, "talker", 10.0, 0, move |tick: &mut Tick| {
        (0..2).for_each(|_| tick.publish(&publisher, ()));
    });
    let (sender, heard) = crossbeam_channel::unbounded();
    let added = graph.node("lamp", Match::Each, 1, |wiring| {
        let mut words = wiring.trigger(&words);
        move |tick: &mut Tick| {
            let taken = std::iter::from_fn(|| tick.read_next(&mut words)).take(3);
            sender.send(taken.map(|word| word.seq).collect::<Vec<_>>())?;
            Ok(Flow::Continue)
        }
    });
    added.expect("a node");
    run_virtual(&mut graph, "", secs(0.1));
    assert!(heard.try_iter().eq([[0], [1], [2], [3]]));
}
