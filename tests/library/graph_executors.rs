//! Graph files with triggers and executors: data ages along triggered nodes, known systems with
//! the figures that their sources give, overloads, and errors with their places.

use ratelab_study::experiment::{Config, Summary};

use crate::{
    graph_file::{chain_lines, run_with, system},
    support::secs,
    table::rows,
};

const SUBSCRIPTION: &str = include_str!("../../graphs/starving-subscription.toml");
const TIMER: &str = include_str!("../../graphs/starving-timer.toml");
const HALF_IDLE: &str = include_str!("../../graphs/half-idle.toml");
const SERVOS: &str = include_str!("../../graphs/three-servos.toml");
const AUTOWARE: &str = include_str!("../../graphs/autoware.toml");

/// A run in virtual time up to `end` (s).
fn run(text: &str, end: f64) -> Summary {
    let config = Config {
        end: secs(end),
        ..Config::default()
    };
    run_with(text, &config)
}

/// The lines about chains at the end of a run.
fn chains(text: &str, end: f64) -> Vec<String> {
    chain_lines(text, &run(text, end))
}

fn ticks(summary: &Summary, node: &str) -> u64 {
    summary.node(node).expect("a node").ticks
}

fn dropped(summary: &Summary, topic: &str) -> u64 {
    summary.topic(topic).expect("a topic").dropped()
}

fn warnings(text: &str) -> Vec<String> {
    let system = system(text).expect("a graph");
    system.warnings(&system.about().setup())
}

/// The same text with another executor.
fn with_executor(text: &str, kind: &str) -> String {
    let (before, rest) = text.split_once("kind = \"").expect("an executor");
    let (_, after) = rest.split_once('"').expect("its kind");
    format!("{before}kind = \"{kind}\"{after}")
}

/// The Autoware reference system with all nodes in one executor, and with another cost.
fn autoware(kind: &str, ms: f64) -> String {
    let (nodes, _) = AUTOWARE.split_once("[executor.front]").expect("executors");
    let nodes = nodes.replace("takes = 5", &format!("takes = {ms}"));
    format!("{nodes}[executor.all]\nkind = \"{kind}\"\n")
}

#[test]
fn a_chain_of_triggered_nodes_is_as_old_as_their_costs_together() {
    let text = r#"
name = "triggered"
[node.camera]
rate = 10
takes = 20
publishes = ["/image"]
[node.detector]
trigger = ["/image"]
takes = 30
publishes = ["/pose"]
[node.control]
trigger = ["/pose"]
takes = 10
[chain.see]
path = ["camera", "/image", "detector", "/pose", "control"]
"#;
    // Out at 60 + 100 k, of the image begun at 100 k; the last one for 40 ms only.
    let wanted = "see data age mean 109.9 ms, greatest 160.0 ms";
    assert_eq!(chains(text, 10.0), [wanted]);
    // A slower detector loses images in its queue, and its ticks are those of the newest kept.
    let slow = text.replace("takes = 30", "takes = 150");
    let summary = run(&slow, 10.0);
    assert_eq!(dropped(&summary, "/image"), 33);
    assert_eq!(ticks(&summary, "detector"), 67);
}

/// Two cameras and a fusion of their images.
fn fusion(matching: &str) -> String {
    format!(
        r#"
name = "fusion"
[node.fast]
rate = 100
publishes = ["/fast"]
[node.slow]
rate = 40
publishes = ["/slow"]
[node.map]
rate = 1
publishes = ["/map"]
[node.fuse]
trigger = ["/fast", "/slow"]
match = "{matching}"
reads = ["/map"]
[chain.by-fast]
path = ["fast", "/fast", "fuse"]
[chain.by-slow]
path = ["slow", "/slow", "fuse"]
[chain.by-map]
path = ["map", "/map", "fuse"]
"#
    )
}

#[test]
fn a_fusion_ticks_with_the_set_that_it_waits_for_and_reads_other_topics_beside_it() {
    let each = run(&fusion("each"), 10.0);
    assert_eq!(ticks(&each, "fuse"), 401);
    let exact = run(&fusion("exact:10"), 10.0);
    assert_eq!(ticks(&exact, "fuse"), 201);
    let lines = chains(&fusion("each"), 10.0);
    // At 50 both arrive; the slow one is taken first, so the fast one of 40 is the newest.
    assert!(lines[0].contains("greatest 35.0 ms"), "{lines:?}");
    assert!(lines[1].contains("greatest 25.0 ms"), "{lines:?}");
    assert!(lines[2].contains("greatest 1000.0 ms"), "{lines:?}");
    let lines = chains(&fusion("exact:10"), 10.0);
    assert!(lines[0].contains("greatest 50.0 ms"), "{lines:?}");
}

#[test]
fn the_subscription_of_rclcpp_2645_starves_with_two_threads_only() {
    let two = run(SUBSCRIPTION, 0.9995);
    assert_eq!((ticks(&two, "s2"), ticks(&two, "s1")), (200, 0));
    let topic = two.topic("/t1").expect("a topic");
    assert_eq!((topic.published, topic.dropped()), (999, 899));
    assert_eq!(two.verdict.name(), "silent_first");
    let one = run(&with_executor(SUBSCRIPTION, "single"), 0.9995);
    assert_eq!((ticks(&one, "s2"), ticks(&one, "s1")), (100, 100));
    assert_eq!(one.verdict.name(), "kept");
}

#[test]
fn the_timer_of_rclcpp_2360_starves_with_two_threads_only() {
    let two = run(TIMER, 1.005);
    assert_eq!((ticks(&two, "a"), ticks(&two, "b")), (100, 0));
    let one = run(&with_executor(TIMER, "single"), 1.005);
    assert_eq!((ticks(&one, "a"), ticks(&one, "b")), (50, 50));
}

#[test]
fn a_timer_starves_on_two_threads_that_are_not_full() {
    let count = |kind| ticks(&run(&with_executor(HALF_IDLE, kind), 6.6), "t4");
    assert_eq!(count("multi:2"), 0);
    assert_eq!(count("multi:1"), 3);
    assert_eq!(count("multi:3"), 6);
    assert_eq!(warnings(HALF_IDLE), Vec::<String>::new());
}

#[test]
fn the_three_servos_miss_the_deadlines_that_are_documented() {
    let done = |kind| {
        let summary = run(&with_executor(SERVOS, kind), 1.0);
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
    let [first, second, third] = done("edf:1");
    assert_eq!((first.0, second.0, third.0), (135, 162, 203));
    assert!(first.2 > 150.0 && second.2 > 150.0 && third.2 > 150.0);
}

#[test]
fn the_hot_path_of_autoware_takes_four_steps_with_threads_enough_and_five_with_one() {
    // To the end of the last node: a step more than to its start.
    let steps = |text: &str| {
        let latency = run(text, 60.0).latency;
        [0.0, 1.0].map(|share| latency.quantile(share).expect("data").as_secs_f64() * 200.0)
    };
    let close = |a: f64, b: f64| (a - b).abs() < 0.1;
    let [least, most] = steps(&autoware("multi:4", 5.0));
    assert!(close(least, 5.0) && close(most, 5.0), "{least} {most}");
    let [least, _] = steps(&autoware("single", 5.0));
    assert!(least > 5.9, "{least}");
    let [least, most] = steps(AUTOWARE);
    assert!(close(least, 5.0) && most < 6.1, "{least} {most}");
}

#[test]
fn one_thread_has_enough_time_for_autoware_up_to_5_26_ms_per_step() {
    assert_eq!(warnings(&autoware("single", 5.26)), Vec::<String>::new());
    let warnings = warnings(&autoware("single", 10.0));
    assert_eq!(
        warnings,
        [
            "executor all is asked for more than it can do: its nodes need 190 % of a core, and \
             single has 100 %, so they wait, skip periods or lose messages"
        ]
    );
    let all_dropped = |text: &str| {
        let summary = run(text, 60.0);
        let hot = ["/FrontLidarDriver", "/RearLidarDriver"];
        hot.map(|topic| dropped(&summary, topic))
            .iter()
            .sum::<u64>()
    };
    assert_eq!(all_dropped(&autoware("single", 5.2)), 0);
    assert!(all_dropped(&autoware("single", 10.0)) > 0);
}

#[test]
fn overloads_of_nodes_groups_and_executors_are_known_before_the_run() {
    let one = |text: &str, part: &str| {
        let warnings = warnings(text);
        assert!(
            warnings.len() == 1 && warnings[0].contains(part),
            "{warnings:?}"
        );
    };
    one(TIMER, "group timers of executor ros");
    one(
        SERVOS,
        "need 123 % of a core, and fixed-priority:1 has 100 %",
    );
    // Two nodes publish to the topic that triggers it.
    let text = "name = \"g\"\n[node.a]\nrate = 30\npublishes = [\"/x\"]\n[node.b]\nrate = 30\n\
                publishes = [\"/x\"]\n[node.c]\ntrigger = [\"/x\"]\ntakes = 20\n";
    one(
        text,
        "c is asked for more than it can do: 20 ms at 60 Hz is 120 %",
    );
    one(text, "messages will wait and be dropped");
}

#[test]
fn ticks_that_often_outlast_their_period_are_an_overload() {
    for [takes, rate, part] in rows(
        "60..110          | 11.7 | 49 % of its ticks take longer than the period of 85.5 ms
         60..110          | 9.2  |
         60..110          | 9    |
         60..110          | 12.5 | 85 ms at 12.5 Hz is 106 % of its time
         lognormal:60,100 | 10   |
         lognormal:60,200 | 10   | 16 % of its ticks take longer than the period of 100.0 ms
         100              | 10   |
         101              | 10   | 101 ms at 10 Hz is 101 % of its time
         none             | 10   |",
    ) {
        let node = format!("[node.plan]\nrate = {rate}\ntakes = \"{takes}\"\n");
        let warnings = warnings(&format!("name = \"g\"\n{node}"));
        let overload = warnings
            .iter()
            .find(|text| text.contains("more than it can do"));
        assert_eq!(
            overload.is_none(),
            part.is_empty(),
            "{takes} at {rate}: {overload:?}"
        );
        if let Some(text) = overload {
            assert!(
                text.contains(&part) && text.contains("skip periods"),
                "{text}"
            );
        }
    }
}

#[test]
fn a_system_in_the_middle_has_triggered_nodes_and_executors() {
    let text = |kind: &str| {
        format!(
            r#"
name = "camera-pole"
[system]
name = "cart-pole"
remap = {{ "/obs" = "/pose" }}
[node.camera]
trigger = ["/obs"]
takes = 10
publishes = ["/image"]
[node.detector]
trigger = ["/image"]
takes = 15
publishes = ["/pose"]
[executor.computer]
kind = "{kind}"
nodes = ["camera", "detector", "policy"]
"#
        )
    };
    // Sensed at 0, an image at 10, a pose at 25, decided at 40, when the actuator has ticked
    // already: executors look last at an instant. Applied at 60.
    let wide = run(&text("multi:3"), 10.0);
    let latency = wide.latency.quantile(0.5).expect("actions");
    assert!((latency.as_secs_f64() - 0.06).abs() < 0.001, "{latency:?}");
    assert_eq!(wide.verdict.name(), "balanced");
    // One thread has 20 ms per period for 25 ms of work.
    let warnings = warnings(&text("single"));
    assert!(warnings[0].contains("125 % of a core"), "{warnings:?}");
    let narrow = run(&text("single"), 10.0);
    assert!(dropped(&narrow, "/image") > 0);
}

#[test]
fn a_group_or_deadline_that_an_executor_has_no_use_for_is_a_warning() {
    let text = r#"
name = "idle"
[node.a]
rate = 10
group = "one"
deadline_ms = 5
[executor.all]
kind = "fixed-priority:1"
"#;
    let kept = warnings(text);
    assert_eq!(
        kept,
        [
            "group of a has no effect: executor fixed-priority:1 has no groups; single, multi and \
             events have",
            "deadline_ms of a has no effect: executor fixed-priority:1 has none; edf has",
        ]
    );
    let single = text.replace("fixed-priority:1", "single");
    assert_eq!(warnings(&single).len(), 1);
}

#[test]
fn a_topic_that_a_node_misses_is_none_of_its_own() {
    let text = "name = \"x\"\n[node.a]\nrate = 10\nreads = [\"/zz\"]\npublishes = [\"/a\"]\n\
                [node.b]\nrate = 10\npublishes = [\"/b\"]\n";
    let error = system(text).err().expect("an error").to_string();
    assert!(
        error.contains("expected /b") && !error.contains("/a"),
        "{error}"
    );
}
