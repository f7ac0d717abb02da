//! Systems other than the cart-pole: the program of `examples/own_plant.rs`, which is the whole
//! command for it, and graph files.

mod support;

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

use support::{complaint, folder, path, ratelab, text};

/// The output of the drone's program with `args`.
fn drone(args: &[&str]) -> Output {
    let built = Path::new(env!("CARGO_BIN_EXE_ratelab")).with_file_name("examples");
    let program = built.join("own_plant");
    Command::new(program)
        .args(args)
        .output()
        .expect("it starts")
}

fn said(args: &[&str]) -> String {
    let output = drone(args);
    assert!(output.status.success(), "{args:?}: {output:?}");
    text(&output.stdout)
}

#[test]
fn its_runs_are_recorded_and_verified_where_the_system_is() {
    let folder = folder();
    let [file, csv] = ["slow.rrd", "slow.csv"].map(|name| path(&folder, name));
    let knob = ["--knob", "rate pilot 1", "--record", &file, "--csv", &csv];
    let run = said(&[&["run", "--clock", "virtual"], &knob[..]].concat());
    assert!(run.contains("pilot 1 Hz"), "{run}");
    assert!(run.contains("DOWN at 3.200 s: 321 plant steps"), "{run}");
    let rows = fs::read_to_string(csv).expect("rows");
    assert!(
        rows.starts_with("time_s,height_m,climb_m_s\n0,0.999"),
        "{rows}"
    );
    assert_eq!(rows.lines().count(), 322);
    assert!(said(&["verify", &file]).contains("identical"));
    assert!(said(&["info", &file]).contains("DOWN at 3.200 s"));
    let refused = complaint(&ratelab(&["verify", &file]), 2);
    assert!(refused.contains("\"drone\""), "{refused}");
    let refused = complaint(&ratelab(&["run", "--like", &file]), 2);
    assert!(refused.contains("of the system drone"), "{refused}");
}

#[test]
fn a_sweep_goes_over_one_of_its_rates() {
    let swept = said(&["sweep", "--axis", "rate pilot", "1,2", "--seeds", "0..9"]);
    for line in [
        "runs      20 of 10 s: 2 pilot rates × 10 seeds",
        "cliff     none completed up to 1 Hz, all from 2 Hz on",
    ] {
        assert!(swept.contains(line), "{line:?} is missing in\n{swept}");
    }
    let refused = complaint(&drone(&["sweep"]), 2);
    assert!(refused.contains("which knob is swept?"), "{refused}");
}

#[test]
fn it_has_its_own_name_and_no_parts_of_the_course() {
    let help = said(&["--help"]);
    assert!(help.contains("Usage: own_plant"), "{help}");
    let pages = [
        &["--help"][..],
        &["run", "--help"],
        &["sweep", "--help"],
        &["keys"],
        &["man"],
    ];
    for page in pages.map(said) {
        for foreign in [
            "exercise",
            "--theory",
            "--break",
            "--policy",
            "control-hz",
            "pole",
        ] {
            assert!(!page.contains(foreign), "{foreign} in {page}");
        }
    }
    assert!(said(&["completions", "fish"]).contains("complete -c own_plant"));
    let refused = complaint(&drone(&["run", "--world", "own"]), 2);
    assert!(refused.contains("no world of its own"), "{refused}");
    for args in [
        &["exercise"][..],
        &["run", "--break"],
        &["sweep", "--theory"],
    ] {
        let refused = complaint(&drone(args), 2);
        assert!(refused.contains("own_plant"), "{refused}");
    }
}

/// The output of `ratelab` with `args`, which must succeed.
fn told(args: &[&str]) -> String {
    let output = ratelab(args);
    assert!(output.status.success(), "{args:?}: {output:?}");
    text(&output.stdout)
}

#[test]
fn a_recording_of_a_graph_file_needs_the_file_no_more() {
    let folder = folder();
    let [file, rrd, web, trace] =
        ["robot.toml", "robot.rrd", "robot.html", "robot.pftrace"].map(|name| path(&folder, name));
    told(&["new", &file]);
    let run = told(&["run", &file, "--clock", "virtual", "--record", &rrd]);
    assert!(
        run.contains("verdict   MISSED (see-to-act older than 400 ms"),
        "{run}"
    );
    let first = told(&[&file, "run", "--clock", "virtual", "--json"]);
    assert!(first.contains("\"missed_see_to_act\""), "{first}");
    fs::remove_file(&file).expect("the file");
    assert!(told(&["verify", &rrd]).contains("identical"));
    let info = told(&["info", &rrd]);
    assert!(
        info.contains("\nchain     see-to-act data age mean"),
        "{info}"
    );
    let branch = told(&["branch", &rrd, "--at", "1", "--knob", "rate planner 15"]);
    assert!(branch.contains("recorded  MISSED (see-to-act"), "{branch}");
    told(&["export-web", &rrd, "-o", &web]);
    told(&["trace", &rrd, "-o", &trace]);
    let refused = complaint(&drone(&["run", "--like", &rrd]), 2);
    assert!(refused.contains("of the graph file robot"), "{refused}");
}

#[test]
fn a_graph_file_is_swept_and_hunted_like_a_system_in_code() {
    let folder = folder();
    let file = path(&folder, "pole.toml");
    fs::write(&file, include_str!("../../graphs/camera-pole.toml")).expect("written");
    let axis = ["--control-hz", "50", "--axis", "takes detector", "15,95"];
    let swept = told(&[&["sweep", &file, "--seeds", "0..1"], &axis[..]].concat());
    assert!(swept.contains("detector cost 95"), "{swept}");
    let fault = ["--hang", "detector=500", "--topic", "/pose"];
    let hunted = told(&[&["hunt", &file], &fault[..]].concat());
    assert!(hunted.contains("hang detector"), "{hunted}");
}

#[test]
fn an_overload_at_one_value_of_a_sweep_is_noted_before_it() {
    let folder = folder();
    let file = path(&folder, "robot.toml");
    fs::write(&file, include_str!("../../graphs/robot.toml")).expect("written");
    let sweep = |rates: &str| {
        let axis = ["--axis", "rate planner", rates, "--seeds", "0"];
        let swept = ratelab(&[&["sweep", &file], &axis[..]].concat());
        assert!(swept.status.success(), "{swept:?}");
        text(&swept.stderr)
    };
    let noted = sweep("5,20");
    let note = "note: rate planner 20: planner is asked for more than it can do: 55 ms at 20 Hz";
    assert!(noted.contains(note), "{noted}");
    assert!(!sweep("5,10").contains("note:"));
}

#[test]
fn errors_in_a_graph_file_name_the_place_and_no_file_is_replaced() {
    let folder = folder();
    let file = path(&folder, "wrong.toml");
    fs::write(&file, "name = \"g\"\n[node.camera]\nrte = 30\n").expect("written");
    let wrong = complaint(&ratelab(&["run", &file]), 2);
    let place = "wrong.toml:3:1: unknown key \"rte\": did you mean \"rate\"?";
    assert!(wrong.trim_end().ends_with(place), "{wrong}");
    let kept = complaint(&ratelab(&["new", &file]), 2);
    assert!(kept.contains("there is such a file"), "{kept}");
    let other = complaint(&ratelab(&["new", "robot.txt"]), 2);
    assert!(other.contains("ends in .toml"), "{other}");
    let none = complaint(&ratelab(&["none.toml"]), 2);
    assert!(none.contains("none.toml: No such file"), "{none}");
    let late = complaint(&ratelab(&["run", "--json", &file]), 2);
    assert!(late.contains("right behind the command"), "{late}");
}
