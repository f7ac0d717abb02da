//! `--like`: a recorded run on the real clock as a model of its machine.

use serde_json::Value;

use crate::support::Folder;

/// Records a second on the real clock to `real.rrd`; its metrics.
fn real(folder: &Folder, options: &str) -> Value {
    folder.json(&format!(
        "run --duration-s 1 --json --record real.rrd {options}"
    ))
}

/// The metrics of a run like that one.
fn like(folder: &Folder, options: &str) -> Value {
    folder.json(&format!("run --like real.rrd --json {options}"))
}

#[test]
fn a_real_run_is_the_model_of_a_virtual_one() {
    let folder = Folder::new();
    folder.write("knobs", "0.5 control-hz 10\n");
    let options = "--world own --seed 7 --sensor-hz 25 --think-ms 30 --knobs knobs";
    let recorded = real(&folder, options);
    let metrics = like(&folder, "");
    for (key, expected) in [("clock", "virtual"), ("world", "own")] {
        assert_eq!(metrics[key], expected);
    }
    for key in ["seed", "sensor_hz", "duration_s"] {
        assert_eq!(metrics[key], recorded[key], "{key}");
    }
    // When it was turned, and not when it was to be.
    let turned = metrics["turned"].to_string();
    assert!(turned.contains("control-hz 10"), "{turned}");
    assert_eq!(turned, recorded["turned"].to_string());
    // What was measured, and what it came to.
    let compared = &metrics["like"]["recorded"];
    for figure in ["count", "p50_ms", "p99_ms", "max_ms"] {
        let [compared, recorded] = [compared, &recorded].map(|run| &run["latency"][figure]);
        assert_eq!(compared, recorded, "{figure}");
    }
    assert_eq!(compared["mean_push_age_ms"], recorded["mean_push_age_ms"]);
    let policy = &recorded["nodes"]["policy"];
    assert_eq!(compared["overruns"]["policy"], policy["overruns"]);
    let cost = &metrics["nodes"]["policy"]["cost"];
    assert!(cost["p50_ms"].as_f64() >= Some(30.0), "{cost}");
    let longest = policy["cost"]["max_ms"].as_f64();
    assert!(cost["max_ms"].as_f64() <= longest, "{cost}");
    let late = &metrics["nodes"]["sensor"]["lateness"];
    assert!(late["max_ms"].as_f64() > Some(0.0), "{late}");
    // The same to the bit, also from a recording of it.
    let again = folder.says("run --like real.rrd --json --record again.rrd");
    assert_eq!(&*again, format!("{metrics:#}\n"));
    folder.says("verify again.rrd");
}

#[test]
fn other_options_change_what_was_recorded() {
    let folder = Folder::new();
    real(&folder, "--seed 7 --think-ms 30");
    let other = like(&folder, "--seed 8 --think-ms 70 --world own --duration-s 2");
    assert_eq!(other["seed"], 8);
    assert_eq!(other["world"], "own");
    assert_eq!(other["nodes"]["policy"]["cost"]["max_ms"], 70.0);
    assert_eq!(other["duration_s"], 2.0);
}

#[test]
fn a_cost_that_changed_on_the_way_is_as_it_was_asked_for() {
    let folder = Folder::new();
    folder.write("knobs", "0.5 think-ms 40\n");
    real(&folder, "--think-ms 10 --knobs knobs");
    let metrics = like(&folder, "");
    let cost = &metrics["nodes"]["policy"]["cost"];
    assert_eq!([&cost["p50_ms"], &cost["max_ms"]], [10.0, 40.0]);
}

#[test]
fn lateness_that_was_set_under_the_real_clock_is_no_part_of_the_model() {
    let folder = Folder::new();
    folder.write("knobs", "0.05 wakes policy 45\n");
    let recorded = real(&folder, "--knobs knobs")["turned"].to_string();
    assert!(recorded.contains("wakes policy 45"), "{recorded}");
    let modelled = like(&folder, "")["turned"].to_string();
    assert!(!modelled.contains("wakes"), "{modelled}");
}
