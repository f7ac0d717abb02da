//! Graphs as text files: data ages along chains, verdicts, settings as knobs, a system in the
//! middle, and errors with their places.

use std::sync::Arc;

use ratelab_cart_pole::CartPole;
use ratelab_study::{
    experiment::{Config, Experiment, Summary},
    graph_file::{GraphFile, GraphFileError, MOST_PARTS},
    system::System,
};

/// The system of a graph file, which may have the cart-pole in its middle.
pub fn system(text: &str) -> Result<Arc<dyn System>, GraphFileError> {
    let known: Arc<dyn System> = Arc::new(CartPole::default());
    let system = GraphFile::parse(text)?.system(&[known])?;
    Ok(Arc::new(system))
}

/// A run of ten seconds in virtual time with `knobs`.
fn run(text: &str, knobs: &[&str]) -> Summary {
    let knobs = knobs.iter().map(|knob| knob.parse().expect("a knob"));
    let config = Config {
        setup: knobs.collect(),
        ..Config::default()
    };
    run_with(text, &config)
}

/// A run in virtual time.
pub fn run_with(text: &str, config: &Config) -> Summary {
    let system = system(text).expect("a graph");
    let experiment = Experiment::new(system, config).expect("a graph");
    experiment.run().expect("no fault")
}

fn chains(text: &str, knobs: &[&str]) -> Vec<String> {
    chain_lines(text, &run(text, knobs))
}

/// The lines about chains at the end of a run.
pub fn chain_lines(text: &str, summary: &Summary) -> Vec<String> {
    let system = system(text).expect("a graph");
    let chains = system.about().chains.iter();
    let lines = chains.map(|chain| chain.line(summary.sim_time, &summary.chains, &[]));
    lines.collect()
}

const PAIR: &str = r#"
name = "pair"
[node.camera]
rate = 10
takes = 20
publishes = ["/image"]
[node.control]
rate = 10
offset = 50
takes = 10
reads = ["/image"]
publishes = ["/cmd"]
[chain.see]
path = ["camera", "/image", "control", "/cmd"]
age_ms = 110
share = 0.5
"#;

#[test]
fn the_age_of_a_chain_is_over_time_and_ends_with_the_run() {
    // Read at 50 + 100 k, of the image taken at 100 k; in force from 60 + 100 k on, so 60 to
    // 160 ms old, the first 50 ms of it within the limit; the last one for 40 ms, all within.
    let within = (99.0 * 50.0 + 40.0) / 9_940.0 * 100.0;
    let mean = (99.0 * 110.0 * 100.0 + 80.0 * 40.0) / 9_940.0;
    let wanted = format!(
        "see data age mean {mean:.1} ms, greatest 160.0 ms, {within:.2} % of the time within \
         110 ms (50 % wanted)"
    );
    assert_eq!(chains(PAIR, &[]), [wanted]);
    let summary = run(PAIR, &[]);
    let verdict = summary.verdict.to_string();
    assert_eq!(
        verdict,
        "KEPT (see at most 110 ms old for 50 % of the time)"
    );
    let graph = system(PAIR).expect("a graph");
    let figures = graph.finals_at(summary.sim_time, &summary.state);
    assert_eq!(figures[0].name, "see_mean_age");
    assert!((summary.latency.mean_s().expect("outputs") - 0.06).abs() < 1e-9);
}

#[test]
fn a_chain_whose_last_node_crashes_grows_old_until_the_end() {
    let config = Config {
        knobs: crate::support::knobs("2 crash control"),
        ..Config::default()
    };
    let summary = run_with(PAIR, &config);
    let crashed = chain_lines(PAIR, &summary);
    // The image of 1.9 s is the last one that came through.
    assert!(crashed[0].contains("greatest 8100.0 ms"), "{crashed:?}");
    assert_eq!(summary.verdict.name(), "missed_see");
    // For programs, the same figure.
    let graph = system(PAIR).expect("a graph");
    let figures = graph.finals_at(summary.sim_time, &summary.state);
    let mut figures = figures.iter();
    let greatest = figures.find(|figure| figure.name == "see_greatest_age");
    assert_eq!(greatest.map(|figure| figure.value), Some(8100.0));
}

#[test]
fn a_chain_without_data_is_missed() {
    let summary = run(PAIR, &["link /image loss:1"]);
    let verdict = summary.verdict.to_string();
    assert_eq!(verdict, "MISSED (no data came through see)");
}

/// Two ways to `fuse`; the chains name one each.
const TWO_WAYS: &str = r#"
name = "fusion"
[node.fast]
rate = 100
publishes = ["/fast"]
[node.slow]
rate = 1
publishes = ["/slow"]
[node.fuse]
rate = 100
reads = ["/fast", "/slow"]
publishes = ["/fused"]
[node.act]
rate = 100
reads = ["/fused"]
[chain.by-fast]
path = ["fast", "/fast", "fuse", "/fused", "act"]
[chain.by-slow]
path = ["slow", "/slow", "fuse", "/fused", "act"]
"#;

#[test]
fn a_chain_follows_its_named_path_where_several_topics_are_read() {
    let lines = chains(TWO_WAYS, &[]);
    assert_eq!(
        lines,
        [
            "by-fast data age mean 5.0 ms, greatest 10.0 ms",
            "by-slow data age mean 500.0 ms, greatest 1000.0 ms"
        ]
    );
    // Without a limit there is nothing to miss.
    assert_eq!(run(TWO_WAYS, &[]).verdict.name(), "completed");
}

#[test]
fn settings_are_knobs_that_those_of_a_run_replace() {
    let settings = system(PAIR).expect("a graph").about().setup();
    let knobs: Vec<String> = settings.iter().map(ToString::to_string).collect();
    assert_eq!(
        knobs,
        [
            "rate camera 10",
            "takes camera 20",
            "rate control 10",
            "offset control 50",
            "takes control 10"
        ]
    );
    let quicker = chains(PAIR, &["takes control none"]);
    assert!(quicker[0].contains("greatest 150.0 ms"), "{quicker:?}");
    let summary = run(PAIR, &["rate camera 50"]);
    assert_eq!(summary.node("camera").expect("a node").hz.get(), 50.0);
}

#[test]
fn nodes_that_are_due_together_tick_in_the_order_of_the_file() {
    let order = |first: &str, second: &str| {
        let node = |name: &str| match name {
            "source" => "[node.source]\nrate = 10\npublishes = [\"/x\"]\n",
            _ => "[node.sink]\nrate = 10\nreads = [\"/x\"]\n",
        };
        let chain = "[chain.c]\npath = [\"source\", \"/x\", \"sink\"]\n";
        let text = format!("name = \"two\"\n{}{}{chain}", node(first), node(second));
        chains(&text, &[]).remove(0)
    };
    let ages = [
        "c data age mean 50.0 ms, greatest 100.0 ms",
        "c data age mean 150.0 ms, greatest 200.0 ms",
    ];
    assert_eq!(order("source", "sink"), ages[0]);
    assert_eq!(order("sink", "source"), ages[1]);
}

/// A camera and a detector between the sensor and the policy of the cart-pole.
const IN_THE_MIDDLE: &str = r#"
name = "camera-pole"
[system]
name = "cart-pole"
remap = { "/obs" = "/pose" }
[node.camera]
rate = 50
takes = 10
reads = ["/obs"]
publishes = ["/image"]
[node.detector]
rate = 50
takes = 15
reads = ["/image"]
publishes = ["/pose"]
[node.logger]
rate = 100
reads = ["/image", "/state"]
takes = 2
"#;

#[test]
fn nodes_before_the_policy_add_their_time_to_the_age_of_the_actions() {
    // Sensed at 0, an image at 10, read at 20, a pose at 35, decided and applied at 40.
    let summary = run(IN_THE_MIDDLE, &[]);
    let latency = summary.latency.quantile(0.5).expect("actions");
    assert!((latency.as_secs_f64() - 0.04).abs() < 0.001, "{latency:?}");
    assert_eq!(summary.verdict.name(), "balanced");
    let age = summary.push_age().expect("pushes");
    assert!((age.run_s - 0.05).abs() < 0.001, "{age:?}");
    let slow = run(IN_THE_MIDDLE, &["takes detector 110"]);
    assert_eq!(slow.verdict.name(), "pole_fell");
    assert!(slow.topic("/pose").expect("a topic").is_read());
}

#[test]
fn without_nodes_before_the_policy_the_runs_are_those_of_the_system() {
    let alone = "name = \"alone\"\n[system]\nname = \"cart-pole\"\n[node.load]\nrate = 100\n";
    let summary = run(alone, &["rate policy 5"]);
    let config = CartPole::config("control-hz 5").expect("knobs");
    let known = Experiment::new(Arc::new(CartPole::default()), &config).expect("a graph");
    let known = known.run().expect("no fault");
    assert_eq!(
        (summary.state, summary.verdict.at),
        (known.state, known.verdict.at)
    );
}

#[test]
fn a_verdict_counts_the_pole_and_the_chains() {
    let chain = "[node.light]\nrate = 2\npublishes = [\"/lamp\"]\n[node.eye]\nrate = 2\n\
                 reads = [\"/lamp\"]\n[chain.blink]\npath = [\"light\", \"/lamp\", \"eye\"]\n\
                 age_ms = 100\n";
    let text = format!("{IN_THE_MIDDLE}{chain}");
    assert_eq!(run(&text, &[]).verdict.name(), "missed_blink");
    let slow = run(&text, &["takes detector 110"]);
    assert_eq!(slow.verdict.name(), "pole_fell");
    let loose = text.replace("age_ms = 100\n", "age_ms = 600\n");
    assert_eq!(run(&loose, &[]).verdict.name(), "balanced");
}

#[test]
fn a_chain_from_the_sensor_of_a_system_counts_from_its_sensing() {
    let chain = |path: &str| format!("{IN_THE_MIDDLE}[chain.log]\npath = [{path}]\n");
    let path = r#""sensor", "/obs", "camera", "/image", "logger""#;
    // An image of 0 ms is there at 10 and logged at 12; then one every 20 ms.
    let wanted = "log data age mean 22.0 ms, greatest 32.0 ms";
    assert_eq!(chains(&chain(path), &[]), [wanted]);
    #[rustfmt::skip]
    let refused = [
        (r#""camera", "/image", "logger""#, "are older than its tick"),
        (r#""actuator", "/state", "logger""#, "are older than its tick"),
        (r#""sensor", "/obs", "camera", "/image""#, "log ends at camera"),
        (r#""sensor", "/state", "logger""#, "no way from sensor to /state"),
    ];
    for (path, what) in refused {
        let error = system(&chain(path)).map(|_| "no error").expect_err(path);
        assert!(error.what.contains(what), "{error}");
    }
}

#[test]
fn overload_is_known_before_the_run() {
    let system = system(PAIR).expect("a graph");
    assert_eq!(
        system.warnings(&system.about().setup()),
        Vec::<String>::new()
    );
    let knob = "takes camera 120".parse().expect("a knob");
    let warnings = system.warnings(&system.about().setup().with(knob));
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!(
        warnings[0].contains("120 ms at 10 Hz is 120 %"),
        "{warnings:?}"
    );
}

#[test]
fn errors_have_a_place_and_a_remedy() {
    let cases = include_str!("../fixtures/graph_errors.txt").split("\n\n");
    let mut count = 0;
    for case in cases.skip(1) {
        let (said, text) = case.split_once('\n').expect("a file");
        let (place, what) = said.split_once(": ").expect("a place");
        let error = system(text)
            .map(|_| "no error")
            .expect_err(case)
            .to_string();
        let rest = error.strip_prefix(&format!("{place}: "));
        assert!(
            rest.is_some_and(|rest| rest.contains(what)),
            "{error}, not {case}"
        );
        count += 1;
    }
    assert_eq!(count, 67);
    let large = GraphFile::parse(&"x".repeat(2 << 20)).expect_err("too large");
    let said = "line 1, column 1: 2097152 bytes: expected up to 1048576";
    assert_eq!(large.to_string(), said);
}

#[test]
fn graphs_up_to_the_limit_run_and_larger_ones_are_refused() {
    let graph = |nodes: usize| {
        let nodes = (0..nodes).map(|node| format!("[node.n{node}]\nrate = 10\n"));
        format!("name = \"many\"\n{}", nodes.collect::<String>())
    };
    let text = graph(MOST_PARTS);
    assert_eq!(run(&text, &[]).nodes.len(), MOST_PARTS);
    let error = GraphFile::parse(&graph(10_000)).expect_err("too large");
    assert!(error.what.contains("10000 parts"), "{error}");
}

#[test]
fn a_circle_of_nodes_runs() {
    let text = "name = \"circle\"\n[node.a]\nrate = 10\nreads = [\"/b\"]\npublishes = [\"/a\"]\n\
                [node.b]\nrate = 10\nreads = [\"/a\"]\npublishes = [\"/b\"]\n";
    let summary = run(text, &[]);
    assert_eq!(
        summary.topic("/a").expect("a topic").published,
        0,
        "each waits for the other"
    );
}
