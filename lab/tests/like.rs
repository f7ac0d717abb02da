//! `--like`: a recorded run on the real clock as a model of its machine.

mod support;

use std::fs;

use serde_json::Value;
use support::{complaint, folder, path, ratelab, reference, text};
use tempfile::TempDir;

/// Records a second on the real clock to the file `name`; its metrics.
fn real(folder: &TempDir, name: &str, args: &[&str]) -> (String, Value) {
    let file = path(folder, name);
    let short = ["run", "--duration-s", "1", "--json", "--record", &file];
    let output = ratelab(&[&short, args].concat());
    assert!(output.status.success(), "{output:?}");
    let metrics = serde_json::from_slice(&output.stdout).expect("metrics");
    (file, metrics)
}

/// What a run like the one in `file` prints.
fn like(file: &str, args: &[&str]) -> String {
    let output = ratelab(&[&["run", "--like", file], args].concat());
    assert!(output.status.success(), "{output:?}");
    text(&output.stdout)
}

#[test]
fn a_real_run_is_the_model_of_a_virtual_one() {
    let folder = folder();
    let knobs = path(&folder, "knobs");
    fs::write(&knobs, "0.5 control-hz 10\n").expect("written");
    let asked = ["--world", "own", "--seed", "7", "--sensor-hz", "25"];
    let timed = ["--think-ms", "30", "--knobs", &knobs];
    let asked: Vec<&str> = asked.into_iter().chain(timed).collect();
    let (file, recorded) = real(&folder, "real.rrd", &asked);
    let metrics: Value = serde_json::from_str(&like(&file, &["--json"])).expect("metrics");
    for (key, expected) in [("clock", "virtual"), ("world", "own")] {
        assert_eq!(metrics[key], expected);
    }
    for key in ["seed", "sensor_hz", "duration_s"] {
        assert_eq!(metrics[key], recorded[key], "{key}");
    }
    // When it was turned, and not when it was to be.
    let turned = |metrics: &Value| metrics["turned"].to_string();
    assert!(turned(&metrics).contains("control-hz 10"));
    assert_eq!(turned(&metrics), turned(&recorded));
    // What was measured, and what it came to.
    let compared = &metrics["like"]["recorded"];
    for figure in ["count", "p50_ms", "p99_ms", "max_ms"] {
        assert_eq!(
            compared["latency"][figure], recorded["latency"][figure],
            "{figure}"
        );
    }
    assert_eq!(compared["mean_push_age_ms"], recorded["mean_push_age_ms"]);
    let policy = &recorded["nodes"]["policy"];
    assert_eq!(compared["overruns"]["policy"], policy["overruns"]);
    let cost = &metrics["nodes"]["policy"]["cost"];
    assert!(cost["p50_ms"].as_f64() >= Some(30.0), "{cost}");
    assert!(
        cost["max_ms"].as_f64() <= policy["cost"]["max_ms"].as_f64(),
        "{cost}"
    );
    let late = &metrics["nodes"]["sensor"]["lateness"];
    assert!(late["max_ms"].as_f64() > Some(0.0), "{late}");
    // The same to the bit, also from a recording of it.
    let again = path(&folder, "again.rrd");
    assert_eq!(
        like(&file, &["--json", "--record", &again]),
        format!("{metrics:#}\n")
    );
    assert!(ratelab(&["verify", &again]).status.success());
}

#[test]
fn other_options_change_what_was_recorded() {
    let folder = folder();
    let (file, _) = real(&folder, "real.rrd", &["--seed", "7", "--think-ms", "30"]);
    let metrics = |args: &[&str]| -> Value {
        serde_json::from_str(&like(&file, &[&["--json"], args].concat())).expect("metrics")
    };
    let other = metrics(&[
        "--seed",
        "8",
        "--think-ms",
        "70",
        "--world",
        "own",
        "--duration-s",
        "2",
    ]);
    assert_eq!(
        (&other["seed"], &other["world"]),
        (&8.into(), &"own".into())
    );
    assert_eq!(other["nodes"]["policy"]["cost"]["max_ms"], 70.0);
    assert_eq!(other["duration_s"], 2.0);
}

#[test]
fn a_cost_that_changed_on_the_way_is_as_it_was_asked_for() {
    let folder = folder();
    let knobs = path(&folder, "knobs");
    fs::write(&knobs, "0.5 think-ms 40\n").expect("written");
    let (file, _) = real(
        &folder,
        "real.rrd",
        &["--think-ms", "10", "--knobs", &knobs],
    );
    let metrics: Value = serde_json::from_str(&like(&file, &["--json"])).expect("metrics");
    let cost = &metrics["nodes"]["policy"]["cost"];
    assert_eq!(
        (&cost["p50_ms"], &cost["max_ms"]),
        (&10.0.into(), &40.0.into())
    );
}

#[test]
fn the_table_has_both_runs_side_by_side() {
    let folder = folder();
    let (file, _) = real(&folder, "real.rrd", &["--world", "own"]);
    let said = like(&file, &[]);
    let rows: Vec<&str> = said
        .lines()
        .skip_while(|line| !line.starts_with("like "))
        .collect();
    let names = [
        "recorded",
        "verdict",
        "sense→act p10",
        "sense→act p50",
        "sense→act p90",
        "sense→act p99",
        "sense→act max",
        "push age mean",
        "overruns world",
        "overruns sensor",
        "overruns policy",
        "overruns actuator",
    ];
    assert_eq!(rows.len(), names.len(), "{said}");
    for (row, name) in rows.iter().zip(names) {
        assert!(row.contains(name), "{name:?} in {row:?}");
    }
}

#[test]
fn what_is_no_model_of_a_machine_is_refused() {
    let folder = folder();
    let (file, _) = real(&folder, "real.rrd", &[]);
    let whole = fs::read(&file).expect("a file");
    let torn = path(&folder, "torn.rrd");
    fs::write(&torn, &whole[..whole.len() * 9 / 10]).expect("written");
    let graph = path(&folder, "graph.rrd");
    let of_file = ["run", "../graphs/one-thread.toml", "--clock", "real"];
    let short = ["--duration-s", "0.2", "--record", &graph];
    assert!(ratelab(&[of_file, short].concat()).status.success());
    let fall = reference("fall-5hz.rrd");
    for (args, part) in [
        (&["--like", &fall][..], "on the virtual clock"),
        (&["--like", &torn], "good up to"),
        (&["--like", "nowhere.rrd"], "nowhere.rrd"),
        (
            &["--like", &graph],
            "the graph file one-thread: give that file, too",
        ),
        (
            &["--like", &file, "--clock", "real"],
            "leave --clock real out",
        ),
        (&["--like", &file, "--realtime"], "--realtime"),
        (&["--like", &file, "--smoke"], "cannot be used with"),
        (&["--like", &file, "--csv", &file], "--csv"),
    ] {
        let said = complaint(&ratelab(&[&["run"], args].concat()), 2);
        assert!(said.contains(part), "{args:?}: {said}");
    }
    assert_eq!(fs::read(&file).expect("a file"), whole);
}
