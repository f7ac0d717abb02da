//! The program of `examples/own_plant.rs`: the whole command for a system other than the
//! cart-pole.

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
    assert!(run.contains("DOWN at 3.200 s: 321 control steps"), "{run}");
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
