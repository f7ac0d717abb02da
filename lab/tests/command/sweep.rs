//! `ratelab sweep`, as used on the command line: output, files and refusals.

use std::{process::Stdio, thread, time::Duration};

use serde_json::Value;

use crate::support::{Folder, Said, send};

/// What a sweep prints, with no word of an error.
#[track_caller]
fn sweep(options: &str) -> Said {
    let output = Folder::new().does(&format!("sweep {options}"));
    let silent = output.status.success() && output.stderr.is_empty();
    assert!(silent, "{output:?}");
    Said::new(&output.stdout)
}

#[track_caller]
fn json(options: &str) -> Value {
    let said = sweep(&format!("--json {options}"));
    serde_json::from_str(&said).expect("stdout is JSON and nothing else")
}

fn list(value: &Value) -> &[Value] {
    value.as_array().expect("a list")
}

#[test]
fn every_cell_equals_a_separate_run() {
    let swept = json("--control-hz 5..8:1.5,10 --seeds 1,2");
    let cells = list(&swept["cells"]);
    assert_eq!(cells.len(), 8);
    for cell in cells {
        let [hz, seed] = ["control_hz", "seed"].map(|key| &cell[key]);
        let run = format!("run --clock virtual --json --control-hz {hz} --seed {seed}");
        let alone = Folder::new().json(&run);
        for (figure, value) in cell.as_object().expect("an object") {
            assert_eq!(&alone[figure], value, "{figure} of {run}");
        }
    }
}

#[test]
fn survival_counts_the_cells() {
    let swept = json("--control-hz 6..8 --seeds 0..29");
    for row in list(&swept["survival"]) {
        let cells = list(&swept["cells"]).iter();
        let cells = cells.filter(|cell| cell["control_hz"] == row["control_hz"]);
        let balanced = cells.filter(|cell| cell["balanced"] == true).count();
        assert_eq!(row["balanced"], balanced);
        assert_eq!(row["runs"], 30);
        assert!(row.get("growth_per_s").is_none());
    }
    assert_eq!(swept["complete"], true);
    assert_eq!(swept["runs"], 90);
}

/// The number of the only line that begins with `text`, and the line.
fn row<'s>(said: &'s Said, text: &str) -> (usize, &'s str) {
    let mut lines = said.lines().enumerate();
    let row = lines.find(|(_, line)| line.trim_start().starts_with(text));
    row.unwrap_or_else(|| panic!("{text} is missing in\n{}", said.0))
}

#[test]
fn edges_are_drawn_where_theory_changes_its_mind() {
    let own = "--world own --duration-s 1 --seeds 0 --theory --knob 'rate actuator 500'";
    let list = |links: &str| {
        let axis = format!("--axis 'link /action' '{links}'");
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
fn an_interrupt_keeps_the_finished_runs_and_prints_their_number() {
    let folder = Folder::new();
    let line = "sweep --control-hz 41..50 --seeds 0..9999 --json --csv rows.csv";
    let mut command = folder.command(line);
    let command = command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let child = command.spawn().expect("ratelab starts");
    // An unfinished file shows that the handler is installed.
    while folder.names("").is_empty() {
        thread::yield_now();
    }
    // Some runs are finished by then, and never all.
    thread::sleep(Duration::from_millis(300));
    send("-INT", child.id());
    let output = child.wait_with_output().expect("ended");
    assert_eq!(output.status.code(), Some(130));
    let swept: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let done = swept["runs"].as_u64().expect("a number");
    assert!(done < 100_000);
    assert_eq!(swept["complete"], false);
    assert_eq!(list(&swept["cells"]).len() as u64, done);
    assert_eq!(folder.read("rows.csv").lines().count() as u64, done + 1);
    Said::new(&output.stderr).has(&format!("{done} of 100000 runs"));
}
