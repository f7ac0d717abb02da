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
    let line = &chains(PAIR, &[])[0];
    let config = Config {
        knobs: CartPole::KNOBS
            .parse_list("2 crash control")
            .expect("a knob"),
        ..Config::default()
    };
    let graph = system(PAIR).expect("a graph");
    let experiment = Experiment::new(graph.clone(), &config).expect("a graph");
    let summary = experiment.run().expect("no fault");
    let crashed = &chain_lines(PAIR, &summary)[0];
    assert_ne!(crashed, line);
    // The image of 1.9 s is the last one that came through.
    assert!(crashed.contains("greatest 8100.0 ms"), "{crashed}");
    assert_eq!(summary.verdict.name(), "missed_see");
    // For programs, the same figure.
    let figures = graph.finals_at(summary.sim_time, &summary.state);
    let greatest = figures
        .iter()
        .find(|figure| figure.name == "see_greatest_age");
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
    assert!(slow.topic("/pose").read);
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
    for (path, what) in [
        (r#""camera", "/image", "logger""#, "are older than its tick"),
        (
            r#""actuator", "/state", "logger""#,
            "are older than its tick",
        ),
        (
            r#""sensor", "/obs", "camera", "/image""#,
            "log ends at camera",
        ),
        (
            r#""sensor", "/state", "logger""#,
            "no way from sensor to /state",
        ),
    ] {
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

/// A graph of one node, with `more` from line 4 on.
fn after_a_node(more: &str) -> String {
    format!("name = \"g\"\n[node.camera]\nrate = 30\n{more}")
}

#[test]
#[allow(clippy::too_many_lines)] // A table.
fn errors_have_a_place_and_a_remedy() {
    for (text, place, what) in [
        (
            "nme = \"g\"\n".to_owned(),
            (1, 1),
            "unknown key \"nme\": did you mean \"name\"?",
        ),
        (
            "name = \"a b\"\n".to_owned(),
            (1, 8),
            "\"a b\" is no name: expected letters",
        ),
        (
            "name = \"g\"\n".to_owned(),
            (1, 1),
            "the graph has no nodes",
        ),
        ("name = \"g\n".to_owned(), (1, 10), "not TOML:"),
        (
            after_a_node("rte = 3\n"),
            (4, 1),
            "unknown key \"rte\": did you mean \"rate\"?",
        ),
        (
            after_a_node("triger = \"/x\"\n"),
            (4, 1),
            "unknown key \"triger\": did you mean \"trigger\"?",
        ),
        (
            after_a_node("[nod.x]\n"),
            (4, 2),
            "unknown key \"nod\": did you mean \"node\"?",
        ),
        (
            after_a_node("takes = \"fast\"\n"),
            (4, 9),
            "takes: \"fast\" is no duration: expected",
        ),
        (
            after_a_node("takes = -3\n"),
            (4, 9),
            "takes: \"-3\" is no duration: expected",
        ),
        (
            after_a_node("takes = true\n"),
            (4, 9),
            "takes: expected a number or a text in quotes, as in the knob takes NODE",
        ),
        (
            after_a_node("deadline_ms = 1e-9\n"),
            (4, 15),
            "deadline_ms: expected milliseconds from 0.001 to 1000000000",
        ),
        (
            after_a_node("takes = \"recorded:x.rrd\"\n"),
            (4, 9),
            "for the command line",
        ),
        (
            after_a_node("[node.b]\nrate = 0\n"),
            (5, 8),
            "\"0\" is not a rate: expected 0.001 to",
        ),
        (
            after_a_node("[node.b]\nrate = 1e99\n"),
            (5, 8),
            "\"1e99\" is not a rate",
        ),
        (
            after_a_node("[node.b]\nrate = nan\n"),
            (5, 8),
            "is not a rate",
        ),
        (after_a_node("[node.b]\n"), (4, 7), "node \"b\" has no rate"),
        (
            after_a_node("[node.camera]\nrate = 1\n"),
            (4, 7),
            "\"camera\" is here twice",
        ),
        (
            after_a_node("[node.\"a b\"]\nrate = 1\n"),
            (4, 7),
            "is no name",
        ),
        (
            after_a_node("reads = [\"/x\"]\n"),
            (4, 10),
            "no node publishes \"/x\": there are none",
        ),
        (
            after_a_node("publishes = [\"image\"]\n"),
            (4, 14),
            "\"image\" is no topic",
        ),
        (
            after_a_node("publishes = [\"/chains\"]\n"),
            (4, 14),
            "/chains has the data ages",
        ),
        (
            after_a_node("publishes = [\"/a\", \"/a\"]\n"),
            (4, 20),
            "\"/a\" is there twice",
        ),
        (
            after_a_node("publishes = [1]\n"),
            (4, 13),
            "publishes: expected a list of topics",
        ),
        (
            after_a_node("[topic.\"/x\"]\n"),
            (4, 8),
            "no node publishes \"/x\"",
        ),
        (
            after_a_node("publishes = [\"/x\"]\n[topic.\"/x\"]\nlink = \"delay:3\"\n"),
            (5, 8),
            "\"/x\" has no reader: leave link out",
        ),
        (
            after_a_node("publishes = [\"/x\"]\n[topic.\"/x\"]\ndepth = 0\n"),
            (6, 9),
            "\"0\" is not a queue depth",
        ),
        (
            after_a_node("publishes = [\"/image\"]\n[chain.c]\npath = [\"camera\", \"/imag\"]\n"),
            (6, 19),
            "camera does not publish \"/imag\": did you mean \"/image\"?",
        ),
        (
            after_a_node("[chain.c]\npath = [\"camera\"]\n"),
            (4, 8),
            "has no way to go",
        ),
        (
            after_a_node("[chain.c]\npath = [\"camra\", \"/x\"]\n"),
            (5, 9),
            "did you mean \"camera\"?",
        ),
        (
            after_a_node("subscribes = [\"/x\"]\n"),
            (4, 1),
            "did you mean \"reads\"?",
        ),
        (
            after_a_node("[chain.c]\npath = [\"camera\", \"camra\"]\n"),
            (5, 19),
            "take turns",
        ),
        (
            after_a_node(
                "publishes = [\"/x\"]\n[chain.c]\npath = [\"camera\", \"/x\"]\nshare = 2\n",
            ),
            (7, 9),
            "share: expected a number above 0, up to 1",
        ),
        (
            after_a_node(
                "publishes = [\"/x\"]\n[chain.c]\npath = [\"camera\", \"/x\"]\nshare = 1\n",
            ),
            (5, 8),
            "has a share without a limit",
        ),
        (
            after_a_node("[system]\nname = \"cartpole\"\n"),
            (5, 8),
            "did you mean \"cart-pole\"?",
        ),
        (
            after_a_node("[system]\nname = \"cart-pole\"\nremap = { \"/x\" = \"/y\" }\n"),
            (6, 11),
            "\"/x\" has no reader that can be remapped: expected /obs or /action",
        ),
        (
            after_a_node("[system]\nname = \"cart-pole\"\nremap = { \"/obs\" = \"/y\" }\n"),
            (6, 20),
            "\"/y\" is no way from \"/obs\": 0 nodes publish",
        ),
        (
            after_a_node("[node.sensor]\nrate = 3\n[system]\nname = \"cart-pole\"\n"),
            (4, 7),
            "the system has a node \"sensor\" already",
        ),
        (
            "x".repeat(2 << 20),
            (1, 1),
            "2097152 bytes: expected up to 1048576",
        ),
    ] {
        let error = system(&text).map(|_| "no error").expect_err(&text);
        let (line, column) = place;
        assert_eq!(
            (error.line, error.column),
            (line, column),
            "{error}\n{text}"
        );
        assert!(error.what.contains(what), "{error}: expected {what:?}");
    }
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
    assert_eq!(summary.topic("/a").published, 0, "each waits for the other");
}
