//! `ratelab hunt`: what it finds can be run again, kept and verified; for any system.

mod support;

use std::{fs, path::Path, process::Command};

use support::{complaint, folder, path, ratelab, text};

fn said(args: &[&str]) -> String {
    let output = ratelab(args);
    assert!(output.status.success(), "{args:?}: {output:?}");
    text(&output.stdout)
}

#[test]
fn what_was_found_loses_the_run_again() {
    let folder = folder();
    let [knobs, file] = ["found.knobs", "found.rrd"].map(|name| path(&folder, name));
    let graph = ["--control-hz", "15", "--duration-s", "6"];
    let files = ["--save", &knobs, "--record", &file];
    let hunt = said(&[&["hunt", "--lose", "8"], &graph[..], &files].concat());
    for line in [
        "hunt      at most 8 messages of /action lost",
        "fault     0 lose /action 1",
        "proven    losing messages 1 to 3 of /action is enough; with each of the 6 smaller lists",
    ] {
        assert!(hunt.contains(line), "{line:?} is missing in\n{hunt}");
    }
    let verdict = hunt.lines().find(|line| line.starts_with("verdict"));
    let run = ["run", "--clock", "virtual", "--knobs", &knobs];
    let run = said(&[&run, &graph[..]].concat());
    assert!(run.contains(verdict.expect("a verdict")), "{run}");
    assert!(said(&["verify", &file]).contains("identical"));
    assert_eq!(
        fs::read_to_string(&knobs).expect("knobs").lines().count(),
        4
    );
    let again = complaint(&ratelab(&["hunt", "--lose", "8", "--save", &knobs]), 2);
    assert!(again.contains("there is such a file"), "{again}");
}

#[test]
fn knobs_that_are_turned_anyway_stay_in_the_file() {
    let folder = folder();
    let [own, knobs] = ["own.knobs", "found.knobs"].map(|name| path(&folder, name));
    fs::write(&own, "1 control-hz 12\n").expect("written");
    let graph = ["--control-hz", "50", "--duration-s", "4", "--knobs", &own];
    let hang = ["--hang", "policy=600", "--save", &knobs, "--json"];
    let hunt = said(&[&["hunt"], &graph[..], &hang].concat());
    assert!(hunt.contains("\"proof\": \"every_smaller\""), "{hunt}");
    let found = fs::read_to_string(&knobs).expect("knobs");
    assert!(found.contains("\n1 control-hz 12\n"), "{found}");
    let run = [
        "run",
        "--clock",
        "virtual",
        "--duration-s",
        "4",
        "--knobs",
        &knobs,
    ];
    assert!(said(&run).contains("FELL at"), "{found}");
}

#[test]
fn what_makes_no_sense_is_refused() {
    for (args, why) in [
        (&["--lose", "0"][..], "nothing may go wrong"),
        (&["--lose", "x"], "invalid value 'x'"),
        (
            &["--lose", "2", "--topic", "/none"],
            "expected one of /obs, /action",
        ),
        (&["--lose", "2", "--break"], "without any fault: FELL at"),
        (&["--hang", "policy"], "expected NODE=MS"),
        (&["--hang", "nobody=90"], "there is no such node"),
        (&["--delay-ms", "-1"], "expected 0 to 60000 milliseconds"),
        (
            &["--lose", "2", "--clock", "real"],
            "leave --clock real out",
        ),
    ] {
        let complaint = complaint(&ratelab(&[&["hunt"], args].concat()), 2);
        assert!(complaint.contains(why), "{args:?}: {complaint}");
    }
}

#[test]
fn any_system_can_be_hunted() {
    let built = Path::new(env!("CARGO_BIN_EXE_ratelab")).with_file_name("examples");
    let mut drone = Command::new(built.join("own_plant"));
    let hunt = ["hunt", "--knob", "rate pilot 3", "--lose", "20"];
    let output = drone.args(hunt).output().expect("it starts");
    let said = text(&output.stdout);
    assert!(output.status.success(), "{output:?}");
    assert!(said.contains("verdict   DOWN at"), "{said}");
    assert!(said.contains("proven    losing message"), "{said}");
}
