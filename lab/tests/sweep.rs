//! `ratelab sweep`, as used on the command line: output, files and refusals.

mod support;

use std::fs;

use serde_json::Value;
use support::{Folder, Said, User};

/// What a sweep prints, with no word of an error.
#[track_caller]
fn sweep(options: &str) -> Said {
    sweep_in(&Folder::new(), options)
}

/// The same, with files in `folder`.
#[track_caller]
fn sweep_in(folder: &Folder, options: &str) -> Said {
    let output = folder.does(&format!("sweep {options}"));
    assert!(output.status.success(), "{output:?}");
    assert!(output.stderr.is_empty(), "{output:?}");
    Said::of(&output.stdout)
}

#[track_caller]
fn json(options: &str) -> Value {
    let said = sweep(&format!("--json {options}"));
    serde_json::from_str(&said).expect("stdout is JSON and nothing else")
}

fn list(value: &Value) -> &[Value] {
    value.as_array().expect("a list")
}

/// Checks that `cell` has the figures of a run with these options, whatever `key` is.
fn assert_as_alone(cell: &Value, key: &str, options: &str) {
    let alone = Folder::new().json(&format!("run --clock virtual --json {options}"));
    for (figure, value) in cell.as_object().expect("an object") {
        if figure != key {
            assert_eq!(&alone[figure], value, "{figure} of {options}");
        }
    }
}

#[test]
fn every_cell_equals_a_separate_run() {
    let swept = json("--control-hz 5..8:1.5,10 --seeds 1,2");
    let cells = list(&swept["cells"]);
    assert_eq!(cells.len(), 8);
    for cell in cells {
        let [hz, seed] = ["control_hz", "seed"].map(|key| &cell[key]);
        assert_as_alone(cell, "", &format!("--control-hz {hz} --seed {seed}"));
    }
}

#[test]
fn survival_counts_the_cells() {
    let swept = json("--control-hz 6..8 --seeds 0..29");
    for row in list(&swept["survival"]) {
        let cells = list(&swept["cells"]).iter();
        let cells = cells.filter(|cell| cell["control_hz"] == row["control_hz"]);
        assert_eq!(
            row["balanced"],
            cells.filter(|c| c["balanced"] == true).count()
        );
        assert_eq!(row["runs"], 30);
        assert!(row.get("growth_per_s").is_none());
    }
    assert_eq!(swept["complete"], true);
    assert_eq!(swept["runs"], 90);
}

#[test]
fn the_number_of_threads_changes_no_byte() {
    let once = |threads: &str| {
        let folder = Folder::new();
        let options = format!("--seeds 0..9 --threads {threads}");
        let said = sweep_in(&folder, &format!("{options} --csv rows.csv --out out"));
        (said, folder.read("out/sweep.json"), folder.read("rows.csv"))
    };
    let alone = once("1");
    assert!(alone == once("2"));
    assert!(alone == once("7"));
}

#[test]
fn rows_have_a_header_and_one_line_per_run() {
    let folder = Folder::new();
    sweep_in(&folder, "--control-hz 5 --seeds 0..2 --csv rows.csv");
    let rows = folder.read("rows.csv");
    let rows: Vec<&str> = rows.lines().collect();
    assert_eq!(rows.len(), 4);
    assert_eq!(rows[0].split(',').count(), rows[1].split(',').count());
    let first = "scripted,50,1,5,0,pole_fell,43,0.84,0.0851";
    assert!(rows[1].starts_with(first), "{}", rows[1]);
}

#[test]
fn the_list_shows_where_the_cliff_is_and_that_it_is_uneven() {
    let said = sweep("--control-hz 5..9,7.5,7.75 --seeds 0..49");
    said.has("graph     policy scripted | sensor 50 Hz | queue depth 1")
        .has("runs      350 of 10 s: 7 control rates × 50 seeds")
        .has("cliff     none balanced up to 6 Hz, all from 9 Hz on")
        .has("uneven    50 of 50 at 7.5 Hz, then 18 of 50 at 7.75 Hz: faster, yet worse")
        // Colours where nobody sees them.
        .lacks("\x1b");
    assert!(
        said.lines().all(|line| line.chars().count() <= 80),
        "{said:?}"
    );
}

#[test]
fn one_seed_has_a_plain_summary_too() {
    sweep("--control-hz 5,10 --seeds 0")
        .has("0 of 1  ····")
        .has("1 of 1  ████");
}

#[test]
fn several_conditions_are_a_map_of_eighty_columns() {
    let said = sweep("--sensor_hz 25,50 --queue_depth 1,2 --ascii --seeds 0..4");
    said.has("sensor 25 depth 1")
        .has("sensor 50 depth 2")
        .has("cells     . none");
    assert!(said.is_ascii(), "{said:?}");
    assert!(said.lines().all(|line| line.len() <= 80), "{said:?}");
}

/// The number of the only line that begins with `text`, and the line.
fn row<'s>(said: &'s Said, text: &str) -> (usize, &'s str) {
    let mut lines = said.lines().enumerate();
    let row = lines.find(|(_, line)| line.trim_start().starts_with(text));
    row.unwrap_or_else(|| panic!("{text} is missing in\n{}", said.0))
}

#[test]
fn theory_stands_beside_the_measurement() {
    let options = "--control-hz 8,10,7.77777 --seeds 0..1 --theory";
    let said = sweep(options);
    for (rate, contains, ends) in [
        ("8 ", "", "+1.71"),
        ("10 ", "2 of 2", "+1.82"),
        // Too long a hyper-period.
        ("7.77777", "", " -"),
    ] {
        let (_, row) = row(&said, rate);
        assert!(row.contains(contains) && row.ends_with(ends), "{row}");
    }
    let swept = json(options);
    assert_eq!(swept["survival"][1]["growth_per_s"], 1.8178);
    assert_eq!(swept["survival"][2]["growth_per_s"], Value::Null);
    // A policy beyond its scope.
    sweep("--control-hz 10 --seeds 0 --policy zero --theory").has(" -\n");
}

#[test]
fn edges_are_drawn_where_theory_changes_its_mind() {
    let own = "--world own --duration-s 1 --seeds 0 --theory --knob 'rate actuator 500'";
    let list = |links: &str| {
        let axis = format!("--axis 'link /action' {links}");
        sweep(&format!("{own} --knob 'control-hz 50' {axis}"))
    };
    for (links, edge, before) in [
        // 59.8 ms in continuous time, less half a period.
        ("delay:40,delay:48,delay:52,delay:60", "┄┄┄", "delay:48"),
        // 57 % by the mean square.
        ("loss:0.5,loss:0.56,loss:0.58", "┄┄┄", "loss:0.56"),
        // 36.8 ms by the jitter margin, less what the actuator and the world add.
        ("delay:0..30,delay:0..38", "┈┈┈", "delay:0..30"),
    ] {
        let said = list(links);
        assert_eq!(row(&said, edge).0, row(&said, before).0 + 1, "{said:?}");
    }
    // What theory does not know gets no edge.
    list("delay:lognormal:1\\,2,delay:lognormal:90\\,99")
        .lacks("┄")
        .lacks("┈");
    let axis = "--control-hz 25,50 --axis 'link /action' delay:0,delay:40,delay:60";
    sweep(&format!("{own} {axis}")).has("┊").has("┄");
}

#[test]
fn runs_are_counted_by_the_age_of_their_pushes() {
    let options = "--control-hz 4..12 --seeds 0..4 --by age";
    let swept = json(options);
    let bins = list(&swept["by_age"]["bins"]);
    let sum = |key: &str| bins.iter().filter_map(|bin| bin[key].as_u64()).sum::<u64>();
    let cells = list(&swept["cells"]).iter();
    let held = cells.filter(|cell| cell["balanced"] == true).count();
    assert_eq!((sum("runs"), sum("balanced")), (45, held as u64));
    let limit = swept["by_age"]["limit_ms"].as_f64().expect("a limit");
    assert!((70.0..95.0).contains(&limit), "{limit}");
    sweep(options).has("parts them best");
}

#[test]
fn curves_are_distinguished_from_a_run() {
    let folder = Folder::new();
    sweep_in(&folder, "--control-hz 5,10 --seeds 0 --record curves.rrd");
    for command in ["info", "verify"] {
        folder
            .refuses(&format!("{command} curves.rrd"))
            .has("curves of a sweep")
            .has("ratelab replay curves.rrd");
    }
}

#[test]
fn bad_input_is_one_line_that_names_option_and_value() {
    let folder = Folder::new();
    folder.write("taken.rrd", "");
    folder.refuses_each(
        "sweep",
        r#"
        --control-hz 30..1   | --control-hz | 30..1 | smaller
        --control-hz 0..5    | --control-hz | 0.001 to 10000
        --control-hz 5,5     | --control-hz | "5" | once
        --seeds -1           | --seeds | -1 | whole number
        --seeds ''           | --seeds | whole number
        --queue-depth 0      | --queue-depth | 1 to 1000000
        --policy alexnet     | --policy | alexnet | scripted
        --policy zero,zero   | --policy | zero | once
        --threads 0          | --threads | 0 | 1 to 1024
        --seeds 0..99999     | 3000000 runs | 2000000 runs at most
        --record taken.rrd   | --record | taken.rrd | another name
        --svg x --csv x      | x: | the file that
        --axis 'rate policy' 1,2 --control-hz 5  | turn the same knob
        --axis 'link /state delay:{}' 0..5       | /state has no reader
        --axis 'link /nothing delay:{}' 0..5     | expected one of
        --axis 'link /obs delay:{}' 5..0         | smaller end first
        --axis 'link /obs loss:{}' 0..2          | expected 0 to 1
        --axis 'takes nobody' 1,2                | expected one of
        --axis 'crash policy' 1                  | expected crash NODE
        --axis on-stale hold,drop                | expected hold or zero:MS
        --axis 'link /obs delay:{}{}' 1,2        | more than one place
        "#,
    );
}

#[cfg(unix)]
#[test]
fn an_interrupt_keeps_the_finished_runs_and_prints_their_number() {
    use std::{process::Stdio, thread, time::Duration};
    let folder = Folder::new();
    let line = "sweep --control-hz 41..50 --seeds 0..9999 --json --csv rows.csv";
    let mut command = folder.command(line);
    let command = command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let child = command.spawn().expect("ratelab starts");
    // An unfinished file shows that the handler is installed.
    while folder.names("").is_empty() {
        thread::sleep(Duration::from_millis(5));
    }
    thread::sleep(Duration::from_millis(300));
    support::send("-INT", child.id());
    let output = child.wait_with_output().expect("ended");
    assert_eq!(output.status.code(), Some(130));
    let swept: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let done = swept["runs"].as_u64().expect("a number");
    assert!(done < 100_000);
    assert_eq!(swept["complete"], false);
    assert_eq!(list(&swept["cells"]).len() as u64, done);
    assert_eq!(folder.read("rows.csv").lines().count() as u64, done + 1);
    Said::of(&output.stderr).has(&format!("{done} of 100000 runs"));
}

#[test]
fn a_comma_in_a_path_has_a_backslash_before_it_and_quotes_in_the_rows() {
    let folder = Folder::with(&["tests/fixtures/policies/actor.pt"]);
    let policy = folder.path("a,b.pt");
    fs::rename(folder.path("actor.pt"), &policy).expect("renamed");
    let policy = policy.display().to_string();
    let policies = format!("--policy lqr,{},zero", policy.replace(',', r"\,"));
    let options = format!("--json --control-hz 5 --seeds 0 {policies} --csv rows.csv");
    let swept: Value = serde_json::from_str(&sweep_in(&folder, &options)).expect("JSON");
    let names: Vec<_> = list(&swept["cells"])
        .iter()
        .map(|cell| &cell["policy"])
        .collect();
    assert_eq!(names, ["lqr", "a,b.pt", "zero"]);
    let rows = folder.read("rows.csv");
    let row = rows.lines().nth(2).expect("a row");
    assert!(row.starts_with(&format!("\"{policy}@sha256:")), "{row}");
    assert!(row.contains("\",50,1,5,0,"), "{row}");
}

#[test]
fn policies_can_be_given_one_by_one() {
    let swept = json("--control-hz 5 --seeds 0 --policy lqr --policy zero,random");
    assert_eq!(list(&swept["cells"]).len(), 3);
}

#[test]
fn any_knob_is_an_axis_and_any_other_is_set_for_all_runs() {
    let own = "--world own --world-step-ms 10 --seeds 0 --knob 'control-hz 5'";
    let swept = json(&format!("{own} --axis 'rate actuator' 25,50"));
    let cells = list(&swept["cells"]);
    for (cell, actuator) in cells.iter().zip([25.0, 50.0]) {
        let rates = [&cell["rate_actuator"], &cell["control_hz"]];
        assert_eq!(rates, [actuator, 5.0]);
    }
    assert_eq!(cells.len(), 2);
    assert_eq!(cells[1]["steps"], 43);
}

#[test]
fn a_hole_in_a_knob_is_swept_as_a_list_a_map_rows_json_and_curves() {
    let own = "--world own --duration-s 5 --seeds 0..1";
    let delay = "--axis 'link /action delay:{}' 0..100:25";
    let folder = Folder::new();
    let files = "--csv rows.csv --record curves.rrd";
    sweep_in(&folder, &format!("{own} {delay} --control-hz 50 {files}"))
        .has("runs      10 of 5 s: 5 /action delays × 1 control rate × 2 seeds")
        .has("/action delay 100");
    let rows = folder.read("rows.csv");
    assert!(rows.starts_with("policy,"), "{rows}");
    assert!(rows.contains("link_action_delay"), "{rows}");
    assert!(folder.bytes("curves.rrd").len() > 1_000);

    sweep(&format!("{own} {delay} --knob 'control-hz 50'"))
        .has("/action delay ms  balanced")
        .has("cliff     none balanced from 100 ms on, all up to 75 ms");
    for costs in ["0..60:20,5..9", "1..5:1"] {
        sweep(&format!(
            "{own} --axis 'takes policy' {costs} --control-hz 50"
        ))
        .has("5 policy costs")
        // The same knob by another name.
        .lacks("think time");
    }

    let swept = json(&format!("{own} {delay} --control-hz 20,50"));
    let cells = list(&swept["cells"]);
    assert_eq!(cells.len(), 20);
    for cell in cells.iter().step_by(3) {
        let [hz, seed, delay] =
            ["control_hz", "seed", "link_action_delay"].map(|key| cell[key].as_f64().expect(key));
        let options = format!(
            "--world own --duration-s 5 --control-hz {hz} --seed {seed} \
             --knob 'link /action delay:{delay}'"
        );
        assert_as_alone(cell, "link_action_delay", &options);
    }
}

#[test]
fn a_sweep_is_a_table_in_markdown() {
    let one = sweep("--control-hz 5,50 --seeds 0..2 --markdown");
    for line in [
        "| control Hz | balanced | latency ms | push age ms | lost at s | cost |",
        "| ---: | ---: | ---: | ---: | ---: | ---: |",
        "| 5 | 0 of 3 | 85.0 | 95.7 | 0.84 | - |",
    ] {
        let whole = one.lines().any(|known| known == line);
        assert!(whole, "{line:?} is missing in\n{}", one.0);
    }
    sweep("--control-hz 5,50 --queue-depth 1,100 --seeds 0..2 --markdown")
        .has("| depth 100 | 0 of 3 | 3 of 3 |");
}

#[test]
fn a_sweep_is_a_heat_map_with_a_number_in_each_cell() {
    let folder = Folder::new();
    let axes = "--axis 'link /action delay:{}' 0,90 --control-hz 5,50";
    sweep_in(&folder, &format!("{axes} --seeds 0..2 --svg map.svg"));
    let svg = Said(folder.read("map.svg"));
    assert_eq!(svg.matches("<title>").count(), 4, "{svg:?}");
    svg.has("<title>/action delay 90 control 50 Hz: 0 of 3</title>");
}
