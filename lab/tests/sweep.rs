//! `ratelab sweep`, as used on the command line: output, files and refusals.

mod support;

use std::{fs, process::Command};

use serde_json::Value;
use tempfile::TempDir;

use support::{path, ratelab, text};

fn sweep(args: &[&str]) -> String {
    let output = ratelab(&[&["sweep"], args].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(output.stderr.is_empty(), "{}", text(&output.stderr));
    text(&output.stdout)
}

fn json(args: &[&str]) -> Value {
    let said = sweep(&[&["--json"], args].concat());
    serde_json::from_str(&said).expect("stdout is JSON and nothing else")
}

#[test]
fn every_cell_equals_a_separate_run() {
    let swept = json(&["--control-hz", "5..8:1.5,10", "--seeds", "1,2"]);
    let cells = swept["cells"].as_array().expect("cells");
    assert_eq!(cells.len(), 8);
    for cell in cells {
        let [hz, seed] = ["control_hz", "seed"].map(|key| cell[key].to_string());
        let args = ["run", "--clock", "virtual", "--json", "--control-hz", &hz];
        let output = ratelab(&[&args[..], &["--seed", &seed]].concat());
        let alone: Value = serde_json::from_slice(&output.stdout).expect("metrics");
        for (key, value) in cell.as_object().expect("an object") {
            assert_eq!(&alone[key], value, "{key} at {hz} Hz, seed {seed}");
        }
    }
}

#[test]
fn survival_counts_the_cells() {
    let swept = json(&["--control-hz", "6..8", "--seeds", "0..29"]);
    let cells = swept["cells"].as_array().expect("cells");
    for row in swept["survival"].as_array().expect("rows") {
        let same = |cell: &&Value| cell["control_hz"] == row["control_hz"];
        let up = cells.iter().filter(same).filter(|c| c["balanced"] == true);
        assert_eq!(row["balanced"], up.count());
        assert_eq!(row["runs"], 30);
        assert!(row.get("growth_per_s").is_none());
    }
    assert_eq!(swept["complete"], true);
    assert_eq!(swept["runs"], 90);
}

#[test]
fn the_number_of_threads_changes_no_byte() {
    let folder = TempDir::new().expect("folder");
    let once = |threads: &str| {
        let (out, csv) = (path(&folder, threads), path(&folder, "rows.csv"));
        let args = ["--seeds", "0..9", "--threads", threads];
        let said = sweep(&[&args[..], &["--csv", &csv, "--out", &out]].concat());
        let json = fs::read(format!("{out}/sweep.json")).expect("JSON");
        (said, json, fs::read(csv).expect("rows"))
    };
    let alone = once("1");
    assert!(alone == once("2"));
    assert!(alone == once("7"));
}

#[test]
fn rows_have_a_header_and_one_line_per_run() {
    let folder = TempDir::new().expect("folder");
    let csv = path(&folder, "rows.csv");
    sweep(&["--control-hz", "5", "--seeds", "0..2", "--csv", &csv]);
    let rows = fs::read_to_string(csv).expect("rows");
    let rows: Vec<&str> = rows.lines().collect();
    assert_eq!(rows.len(), 4);
    assert_eq!(rows[0].split(',').count(), rows[1].split(',').count());
    assert!(
        rows[1].starts_with("scripted,50,1,5,0,pole_fell,43,0.84,0.0851"),
        "{}",
        rows[1]
    );
}

#[test]
fn the_list_shows_where_the_cliff_is_and_that_it_is_uneven() {
    let said = sweep(&["--control-hz", "5..9,7.5,7.75", "--seeds", "0..49"]);
    for line in [
        "graph     policy scripted | sensor 50 Hz | queue depth 1",
        "runs      350 of 10 s: 7 control rates × 50 seeds",
        "cliff     none balanced up to 6 Hz, all from 9 Hz on",
        "uneven    50 of 50 at 7.5 Hz, then 18 of 50 at 7.75 Hz: faster, yet worse",
    ] {
        assert!(said.contains(line), "{line:?} is missing in\n{said}");
    }
    assert!(!said.contains('\x1b'), "colours where nobody sees them");
    assert!(
        said.lines().all(|line| line.chars().count() <= 80),
        "{said}"
    );
}

#[test]
fn one_seed_has_a_plain_summary_too() {
    let said = sweep(&["--control-hz", "5,10", "--seeds", "0"]);
    assert!(said.contains("0 of 1  ····"), "{said}");
    assert!(said.contains("1 of 1  ████"), "{said}");
}

#[test]
fn several_conditions_are_a_map_of_eighty_columns() {
    let args = ["--sensor_hz", "25,50", "--queue_depth", "1,2", "--ascii"];
    let said = sweep(&[&args[..], &["--seeds", "0..4"]].concat());
    assert!(said.is_ascii(), "{said}");
    for line in ["sensor 25 depth 1", "sensor 50 depth 2", "cells     . none"] {
        assert!(said.contains(line), "{line:?} is missing in\n{said}");
    }
    assert!(said.lines().all(|line| line.len() <= 80), "{said}");
}

#[test]
fn theory_stands_beside_the_measurement() {
    let args = [
        "--control-hz",
        "8,10,7.77777",
        "--seeds",
        "0..1",
        "--theory",
    ];
    let said = sweep(&args);
    let row = |rate: &str| {
        let mut lines = said.lines();
        let row = lines.find(|line| line.trim_start().starts_with(rate));
        row.unwrap_or_else(|| panic!("{rate} is missing in\n{said}"))
    };
    assert!(row("8 ").ends_with("+1.71"), "{said}");
    assert!(row("10 ").ends_with("+1.82"), "{said}");
    assert!(row("10 ").contains("2 of 2"), "{said}");
    assert!(row("7.77777").ends_with(" -"), "too long a hyper-period");
    let swept = json(&args);
    assert_eq!(swept["survival"][1]["growth_per_s"], 1.8178);
    assert_eq!(swept["survival"][2]["growth_per_s"], Value::Null);
}

#[test]
fn edges_are_drawn_where_theory_changes_its_mind() {
    let own = [
        "--world",
        "own",
        "--duration-s",
        "1",
        "--seeds",
        "0",
        "--theory",
    ];
    let fixed = ["--knob", "control-hz 50", "--knob", "rate actuator 500"];
    let list = |links: &str| {
        let axis = ["--axis", "link /action", links];
        sweep(&[&own[..], &fixed, &axis].concat())
    };
    let place = |said: &str, text: &str| {
        let mut lines = said.lines();
        let place = lines.position(|line| line.trim_start().starts_with(text));
        place.unwrap_or_else(|| panic!("{text} is missing in\n{said}"))
    };
    // 59.8 ms in continuous time, less half a period.
    let delays = list("delay:40,delay:48,delay:52,delay:60");
    assert_eq!(
        place(&delays, "┄┄┄"),
        place(&delays, "delay:48") + 1,
        "{delays}"
    );
    // 57 % by the mean square.
    let losses = list("loss:0.5,loss:0.56,loss:0.58");
    assert_eq!(
        place(&losses, "┄┄┄"),
        place(&losses, "loss:0.56") + 1,
        "{losses}"
    );
    // 36.8 ms by the jitter margin, less what the actuator and the world add.
    let jitter = list("delay:0..30,delay:0..38");
    assert_eq!(
        place(&jitter, "┈┈┈"),
        place(&jitter, "delay:0..30") + 1,
        "{jitter}"
    );
    // What theory does not know gets no edge.
    let unknown = list("delay:lognormal:1\\,2,delay:lognormal:90\\,99");
    assert!(
        !unknown.contains('┄') && !unknown.contains('┈'),
        "{unknown}"
    );
    let map = ["--axis", "link /action", "delay:0,delay:40,delay:60"];
    let rates = ["--control-hz", "25,50", "--knob", "rate actuator 500"];
    let map = sweep(&[&own[..], &rates, &map].concat());
    assert!(map.contains('┊') && map.contains('┄'), "{map}");
}

#[test]
fn runs_are_counted_by_the_age_of_their_pushes() {
    let args = ["--control-hz", "4..12", "--seeds", "0..4", "--by", "age"];
    let swept = json(&args);
    let bins = swept["by_age"]["bins"].as_array().expect("bins");
    let sum = |key: &str| bins.iter().filter_map(|bin| bin[key].as_u64()).sum::<u64>();
    let cells = swept["cells"].as_array().expect("cells");
    let held = cells.iter().filter(|cell| cell["balanced"] == true).count();
    assert_eq!((sum("runs"), sum("balanced")), (45, held as u64));
    let limit = swept["by_age"]["limit_ms"].as_f64().expect("a limit");
    assert!((70.0..95.0).contains(&limit), "{limit}");
    let said = sweep(&args);
    assert!(said.contains("parts them best"), "{said}");
}

#[test]
fn theory_is_left_out_for_policies_beyond_its_scope() {
    let args = ["--control-hz", "10", "--seeds", "0", "--policy", "zero"];
    let said = sweep(&[&args[..], &["--theory"]].concat());
    assert!(said.contains(" -\n"), "{said}");
}

#[test]
fn curves_are_distinguished_from_a_run() {
    let folder = TempDir::new().expect("folder");
    let curves = path(&folder, "curves.rrd");
    sweep(&["--control-hz", "5,10", "--seeds", "0", "--record", &curves]);
    for command in ["info", "verify"] {
        let output = ratelab(&[command, &curves]);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains("curves of a sweep"), "{said}");
        assert!(said.contains(&format!("ratelab replay {curves}")), "{said}");
    }
}

#[test]
fn bad_input_is_one_line_that_names_option_and_value() {
    let folder = TempDir::new().expect("folder");
    let taken = path(&folder, "taken.rrd");
    fs::write(&taken, "").expect("file");
    let cases: [(&[&str], &[&str]); 11] = [
        (
            &["--control-hz", "30..1"],
            &["--control-hz", "30..1", "smaller"],
        ),
        (
            &["--control-hz", "0..5"],
            &["--control-hz", "0.001 to 10000"],
        ),
        (&["--control-hz", "5,5"], &["--control-hz", "\"5\"", "once"]),
        (&["--seeds", "-1"], &["--seeds", "-1", "whole number"]),
        (&["--seeds", ""], &["--seeds", "whole number"]),
        (&["--queue-depth", "0"], &["--queue-depth", "1 to 1000000"]),
        (
            &["--policy", "alexnet"],
            &["--policy", "alexnet", "scripted"],
        ),
        (&["--policy", "zero,zero"], &["--policy", "zero", "once"]),
        (&["--threads", "0"], &["--threads", "0", "1 to 1024"]),
        (
            &["--seeds", "0..99999"],
            &["3000000 runs", "2000000 runs at most"],
        ),
        (
            &["--record", &taken],
            &["--record", "taken.rrd", "another name"],
        ),
    ];
    for (args, expected) in cases {
        let output = ratelab(&[&["sweep"], args].concat());
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?} said {said}");
        assert_eq!(said.lines().count(), 1, "{args:?} said {said}");
        assert!(output.stdout.is_empty(), "{args:?} printed a result");
        for word in expected {
            assert!(said.contains(word), "{args:?} said {said}");
        }
    }
}

#[cfg(unix)]
#[test]
fn an_interrupt_keeps_the_finished_runs_and_prints_their_number() {
    use std::{process::Stdio, thread, time::Duration};
    let folder = TempDir::new().expect("folder");
    let csv = path(&folder, "rows.csv");
    let child = Command::new(env!("CARGO_BIN_EXE_ratelab"))
        .args(["sweep", "--control-hz", "41..50", "--seeds", "0..9999"])
        .args(["--json", "--csv", &csv])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("ratelab starts");
    // An unfinished file shows that the handler is installed.
    while folder.path().read_dir().expect("folder").count() == 0 {
        thread::sleep(Duration::from_millis(5));
    }
    thread::sleep(Duration::from_millis(300));
    let pid = child.id().to_string();
    let kill = Command::new("kill").args(["-INT", &pid]).status();
    assert!(kill.expect("kill").success());
    let output = child.wait_with_output().expect("ended");
    assert_eq!(output.status.code(), Some(130));
    let swept: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let done = swept["runs"].as_u64().expect("a number");
    assert!(done < 100_000);
    assert_eq!(swept["complete"], false);
    assert_eq!(swept["cells"].as_array().expect("cells").len() as u64, done);
    let rows = fs::read_to_string(csv).expect("rows");
    assert_eq!(rows.lines().count() as u64, done + 1);
    let said = text(&output.stderr);
    assert!(said.contains(&format!("{done} of 100000 runs")), "{said}");
}

#[test]
fn a_comma_in_a_path_has_a_backslash_before_it_and_quotes_in_the_rows() {
    let folder = TempDir::new().expect("folder");
    let policy = path(&folder, "a,b.pt");
    fs::copy("../tests/fixtures/policies/actor.pt", &policy).expect("copied");
    let policies = format!("lqr,{},zero", policy.replace(',', r"\,"));
    let csv = path(&folder, "rows.csv");
    let args = ["--control-hz", "5", "--seeds", "0", "--policy", &policies];
    let swept = json(&[&args[..], &["--csv", &csv]].concat());
    let cells = swept["cells"].as_array().expect("cells");
    let names: Vec<_> = cells.iter().map(|cell| &cell["policy"]).collect();
    assert_eq!(names, ["lqr", "a,b.pt", "zero"]);
    let rows = fs::read_to_string(csv).expect("rows");
    let row = rows.lines().nth(2).expect("a row");
    assert!(row.starts_with(&format!("\"{policy}@sha256:")), "{row}");
    assert!(row.contains("\",50,1,5,0,"), "{row}");
}

#[test]
fn policies_can_be_given_one_by_one() {
    let args = ["--control-hz", "5", "--seeds", "0", "--policy", "lqr"];
    let swept = json(&[&args[..], &["--policy", "zero,random"]].concat());
    assert_eq!(swept["cells"].as_array().expect("cells").len(), 3);
}

#[test]
fn any_knob_is_an_axis_and_any_other_is_set_for_all_runs() {
    let args = ["--axis", "rate actuator", "25,50", "--knob", "control-hz 5"];
    let own = ["--world", "own", "--world-step-ms", "10", "--seeds", "0"];
    let swept = json(&[&args[..], &own].concat());
    let cells = swept["cells"].as_array().expect("cells");
    let values = |key: &str| {
        cells
            .iter()
            .map(|cell| cell[key].clone())
            .collect::<Vec<_>>()
    };
    assert_eq!(values("rate_actuator"), [25.0, 50.0]);
    assert_eq!(values("control_hz"), [5.0, 5.0]);
    assert_eq!(cells[1]["steps"], 43);
    let twice = ["sweep", "--axis", "rate policy", "1,2", "--control-hz", "5"];
    let said = support::complaint(&ratelab(&twice), 2);
    assert!(said.contains("turn the same knob"), "{said}");
}

#[test]
fn a_hole_in_a_knob_is_swept_as_a_list_a_map_rows_json_and_curves() {
    let folder = TempDir::new().expect("folder");
    let (csv, curves) = (path(&folder, "rows.csv"), path(&folder, "curves.rrd"));
    let world = ["--world", "own", "--duration-s", "5", "--seeds", "0..1"];
    let delay = ["--axis", "link /action delay:{}", "0..100:25"];
    let fixed = ["--control-hz", "50", "--csv", &csv, "--record", &curves];
    let list = sweep(&[&world[..], &delay, &fixed].concat());
    for line in [
        "runs      10 of 5 s: 5 /action delays × 1 control rate × 2 seeds",
        "/action delay 100",
    ] {
        assert!(list.contains(line), "{line:?} is missing in\n{list}");
    }
    let rows = fs::read_to_string(csv).expect("rows");
    assert!(rows.starts_with("policy,"), "{rows}");
    assert!(rows.contains("link_action_delay"), "{rows}");
    assert!(fs::metadata(curves).expect("curves").len() > 1_000);

    let only = ["--knob", "control-hz 50"];
    let list = sweep(&[&world[..], &delay, &only].concat());
    for line in [
        "/action delay ms  balanced",
        "cliff     none balanced from 100 ms on, all up to 75 ms",
    ] {
        assert!(list.contains(line), "{line:?} is missing in\n{list}");
    }

    let costs = [
        "--axis",
        "takes policy",
        "0..60:20,5..9",
        "--control-hz",
        "50",
    ];
    let map = sweep(&[&world[..], &costs].concat());
    assert!(map.contains("5 policy costs"), "{map}");
    assert!(
        !map.contains("think time"),
        "the same knob by another name: {map}"
    );
    let range = ["--axis", "takes policy", "1..5:1", "--control-hz", "50"];
    let map = sweep(&[&world[..], &range].concat());
    assert!(map.contains("5 policy costs"), "{map}");

    let swept = json(&[&world[..], &delay, &["--control-hz", "20,50"]].concat());
    let cells = swept["cells"].as_array().expect("cells");
    assert_eq!(cells.len(), 20);
    for cell in cells.iter().step_by(3) {
        let [hz, seed, delay] = ["control_hz", "seed", "link_action_delay"]
            .map(|key| cell[key].as_f64().expect(key).to_string());
        let knob = format!("link /action delay:{delay}");
        let args = ["run", "--clock", "virtual", "--json", "--control-hz", &hz];
        let world = ["--world", "own", "--duration-s", "5", "--knob", &knob];
        let output = ratelab(&[&args[..], &world, &["--seed", &seed]].concat());
        let alone: Value = serde_json::from_slice(&output.stdout).expect("metrics");
        for (key, value) in cell.as_object().expect("an object") {
            if key != "link_action_delay" {
                assert_eq!(&alone[key], value, "{key} at {delay} ms, seed {seed}");
            }
        }
    }
}

#[test]
fn a_knob_of_a_sweep_that_cannot_be_meant_is_refused_in_one_line() {
    for (knob, list, part) in [
        ("link /state delay:{}", "0..5", "/state has no reader"),
        ("link /nothing delay:{}", "0..5", "expected one of"),
        ("link /obs delay:{}", "5..0", "smaller end first"),
        ("link /obs loss:{}", "0..2", "expected 0 to 1"),
        ("takes nobody", "1,2", "expected one of"),
        ("crash policy", "1", "expected crash NODE"),
        ("on-stale", "hold,drop", "expected hold or zero:MS"),
        ("link /obs delay:{}{}", "1,2", "more than one place"),
    ] {
        let said = support::complaint(&ratelab(&["sweep", "--axis", knob, list]), 2);
        assert!(said.contains(part), "{knob} {list}: {said}");
    }
}

#[test]
fn a_sweep_is_a_table_in_markdown() {
    let one = sweep(&["--control-hz", "5,50", "--seeds", "0..2", "--markdown"]);
    for line in [
        "| control Hz | balanced | latency ms | push age ms | lost at s | cost |",
        "| ---: | ---: | ---: | ---: | ---: | ---: |",
        "| 5 | 0 of 3 | 85.0 | 95.7 | 0.84 | - |",
    ] {
        assert!(
            one.lines().any(|l| l == line),
            "{line:?} is missing in\n{one}"
        );
    }
    let axes = [
        "--control-hz",
        "5,50",
        "--queue-depth",
        "1,100",
        "--seeds",
        "0..2",
    ];
    let two = sweep(&[&axes[..], &["--markdown"]].concat());
    assert!(two.contains("| depth 100 | 0 of 3 | 3 of 3 |"), "{two}");
}

#[test]
fn a_sweep_is_a_heat_map_with_a_number_in_each_cell() {
    let folder = TempDir::new().expect("folder");
    let file = path(&folder, "map.svg");
    let axes = [
        "--axis",
        "link /action delay:{}",
        "0,90",
        "--control-hz",
        "5,50",
    ];
    sweep(&[&axes[..], &["--seeds", "0..2", "--svg", &file]].concat());
    let svg = fs::read_to_string(&file).expect("written");
    assert_eq!(svg.matches("<title>").count(), 4, "{svg}");
    assert!(
        svg.contains("<title>/action delay 90 control 50 Hz: 0 of 3</title>"),
        "{svg}"
    );
    let output = ratelab(&["sweep", "--svg", &file, "--csv", &file]);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
}
