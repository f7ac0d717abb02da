//! `ratelab advise`: each line names the run that gives its figures.

use serde_json::Value;

use crate::support::{Folder, shell};

/// A robot on one thread, with a late link and a queue that is read from its old end.
const GRAPH: &str = r#"
name = "robot"
[node]
camera = { rate = 30, publishes = ["/image"] }
detector = { rate = 10, takes = "20..40", reads = ["/image"], publishes = ["/objects"] }
planner = { rate = 12, takes = 10, reads = ["/objects"], publishes = ["/path"] }
control = { rate = 50, takes = 1, reads = ["/path"] }
[topic]
"/objects" = { link = "delay:10..30", depth = 3, read = "oldest" }
[executor.one]
kind = "fixed-priority:1"
nodes = ["detector", "planner", "control"]
[chain.see]
path = ["camera", "/image", "detector", "/objects", "planner", "/path", "control"]
age_ms = 90
share = 0.99
"#;

#[test]
fn the_command_of_a_change_gives_its_figures_whatever_it_changes() {
    let folder = Folder::new();
    folder.write("robot.toml", GRAPH);
    let advice = folder.json("advise robot.toml --seed 3 --duration-s 4 --json");
    let changes = advice["changes"].as_array().expect("a list");
    let means: Vec<i64> = changes
        .iter()
        .filter_map(|run| run["mean_ns"].as_i64())
        .collect();
    assert!(means.len() > 30, "{advice:#}");
    let mut kinds = vec![
        "rate detector 20",
        "offset planner",
        "takes detector 10..20",
        "link /objects delay:5..15",
        "read /objects newest",
        "depth /objects 1",
        "node.detector.trigger",
        "node.planner.priority",
        "executor.one.nodes",
        "executor.one.kind",
        "takes detector 2.5..5",
        "--knob",
        "--with",
    ];
    for change in changes {
        let command = change["command"].as_str().expect("a text");
        let new = kinds.iter().any(|kind| command.contains(kind));
        kinds.retain(|kind| !command.contains(kind));
        if new {
            let run = shell(&folder.path(""), &format!("{command} --json")).output();
            let run: Value = serde_json::from_slice(&run.expect("a shell").stdout).expect(command);
            let age = &run["age_parts"][0];
            let mean = run["see_mean_age"].as_f64().map(|ms| ms * 1e6);
            let [mean, told] = [mean, change["mean_ns"].as_f64()].map(|mean| mean.expect("a mean"));
            assert!((mean - told).abs() < 100.0, "{command}: {mean} {told}");
            assert_eq!(age["p99_ns"], change["p99_ns"], "{command}");
            assert_eq!(run["cause_of_end"], change["cause_of_end"], "{command}");
        }
    }
    assert!(kinds.is_empty(), "{kinds:?}: {advice:#}");
}
