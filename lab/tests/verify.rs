//! `ratelab verify`, as used on the command line: identical runs, different runs, and the
//! reasons.

mod support;

use std::{fs, path::Path};

use tempfile::TempDir;

use support::{complaint, folder, path, ratelab, reference, text};

/// Records a virtual run with `args` to the file `name` in `folder`.
fn record(folder: &TempDir, name: &str, args: &[&str]) -> String {
    let file = path(folder, name);
    let args = [&["run", "--clock", "virtual", "--record", &file], args].concat();
    let output = ratelab(&args);
    assert!(output.status.success(), "{output:?}");
    assert!(text(&output.stdout).contains("recorded  "), "{output:?}");
    file
}

#[test]
fn the_reference_recordings_are_reproduced_and_match_their_readme() {
    let told = [
        (
            "balanced-50hz.rrd",
            "identical, 3 topics, 1,503 messages",
            "mean 0.0 ms",
        ),
        (
            "fall-5hz.rrd",
            "identical, 3 topics, 91 messages",
            "FELL at 0.840 s",
        ),
        (
            "rescued.rrd",
            "identical, 3 topics, 1,004 messages",
            "knob      2.116662647 control-hz 25",
        ),
    ];
    for (name, identical, info) in told {
        let output = ratelab(&["verify", &reference(name)]);
        assert!(output.status.success(), "{output:?}");
        assert!(text(&output.stdout).contains(identical), "{output:?}");
        let output = ratelab(&["info", &reference(name)]);
        assert!(
            output.status.success() && text(&output.stdout).contains(info),
            "{output:?}"
        );
    }
}

#[test]
fn a_real_clock_recording_is_verified_however_its_threads_are_scheduled() {
    let folder = folder();
    let file = path(&folder, "real.rrd");
    assert!(
        ratelab(&["run", "--duration-s", "0.5", "--record", &file])
            .status
            .success()
    );
    for args in [&["verify", &file][..], &["verify", "--perturb", &file]] {
        let output = ratelab(args);
        assert!(text(&output.stdout).contains("identical"), "{output:?}");
    }
    assert!(ratelab(&["info", &file]).status.success());
}

#[test]
fn a_command_that_is_carried_out_after_the_end_of_the_run_is_a_part_of_the_recording() {
    let folder = folder();
    let knobs = path(&folder, "late.knobs");
    // Due just before the end: a thread is awake for it only after the end.
    let late = ["takes policy 1", "queue-depth 3", "sensor-hz 30"];
    let late = late.map(|knob| format!("0.0999999 {knob}\n"));
    fs::write(&knobs, late.concat()).expect("written");
    for name in ["a.rrd", "b.rrd", "c.rrd"] {
        let file = path(&folder, name);
        let run = ["--duration-s", "0.1", "--knobs", &knobs, "--record", &file];
        let output = ratelab(&[&["run"][..], &run].concat());
        assert!(output.status.success(), "{output:?}");
        let output = ratelab(&["verify", &file]);
        assert!(output.status.success(), "{output:?}");
    }
}

#[test]
fn a_branch_of_a_fall_stays_up_without_what_made_it_fall() {
    let folder = folder();
    let file = path(&folder, "fall.rrd");
    let args = [
        "run",
        "--think-ms",
        "230",
        "--duration-s",
        "2",
        "--record",
        &file,
    ];
    assert!(ratelab(&args).status.success());
    let branch = ["branch", &file, "--at", "0.2", "--knob", "takes policy 0"];
    let output = ratelab(&branch);
    let printed = text(&output.stdout);
    for part in ["last rest", "FELL at", "BALANCED", "on: balanced"] {
        assert!(printed.contains(part), "{output:?}");
    }
    // The branch is a recording, too.
    let kept = path(&folder, "branch.rrd");
    let output = ratelab(&[&branch[..], &["--record", &kept]].concat());
    assert!(text(&output.stdout).contains("recorded"), "{output:?}");
    let info = text(&ratelab(&["info", &kept]).stdout);
    for part in ["BALANCED", "on to the virtual clock", "think-ms none"] {
        assert!(info.contains(part), "{info}");
    }
    let output = ratelab(&["verify", &kept]);
    assert!(text(&output.stdout).contains("identical"), "{output:?}");
    // So it can be left in its turn.
    let output = ratelab(&["branch", &kept, "--at", "0.4", "--knob", "takes policy 250"]);
    assert!(
        text(&output.stdout).contains("branch    FELL"),
        "{output:?}"
    );
    for (wrong, said) in [
        (
            &["--at", "9", "--knob", "takes policy 0"][..],
            "choose an earlier moment",
        ),
        (
            &["--at", "0.2", "--knob", "takes nobody 0"],
            "expected one of sensor, policy",
        ),
        (
            &[
                "--at",
                "0.2",
                "--knob",
                "rate policy 5",
                "--duration-s",
                "0.1",
            ],
            "choose a later end",
        ),
    ] {
        let output = ratelab(&[&["branch", &file], wrong].concat());
        assert!(complaint(&output, 2).contains(said), "{output:?}");
    }
}

#[test]
fn a_branch_at_the_end_of_a_run_goes_on_for_some_seconds() {
    let folder = folder();
    let file = path(&folder, "short.rrd");
    let args = [
        "run",
        "--clock",
        "virtual",
        "--duration-s",
        "1",
        "--record",
        &file,
    ];
    assert!(ratelab(&args).status.success());
    let branch = ["branch", &file, "--at", "1", "--knob", "takes policy 250"];
    let output = ratelab(&branch);
    assert!(
        text(&output.stdout).contains("branch    FELL"),
        "{output:?}"
    );
}

#[test]
fn all_of_several_recordings_are_verified_even_after_a_failure() {
    let folder = folder();
    let good = record(&folder, "good.rrd", &["--break"]);
    let bad = path(&folder, "bad.rrd");
    fs::write(&bad, "").expect("written");
    let output = ratelab(&["verify", &bad, &good]);
    assert!(
        text(&output.stdout).contains("good.rrd: identical"),
        "{output:?}"
    );
    let said = text(&output.stderr);
    assert!(
        said.contains("bad.rrd: ") && said.contains("1 of 2"),
        "{said}"
    );
    assert_eq!(output.status.code(), Some(1));
}

#[test]
fn a_run_that_swaps_policies_is_verified_and_a_changed_policy_is_named() {
    let folder = folder();
    let fixture = |name: &str| {
        let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/fixtures/policies");
        tests.join(name)
    };
    let policy = path(&folder, "actor.pt");
    fs::copy(fixture("actor.pt"), &policy).expect("copied");
    let knobs = path(&folder, "swaps.knobs");
    let swaps = format!("0.5 policy lqr\n1 policy {policy}\n1.1 policy scripted\n");
    fs::write(&knobs, swaps).expect("written");
    let file = record(&folder, "swaps.rrd", &["--knobs", &knobs]);
    let output = ratelab(&["verify", &file]);
    assert!(text(&output.stdout).contains("identical"), "{output:?}");
    fs::copy(fixture("half.pt"), &policy).expect("copied");
    let said = complaint(&ratelab(&["verify", &file]), 1);
    assert!(
        said.contains("actor.pt") && said.contains("SHA-256"),
        "{said}"
    );
    fs::remove_file(&policy).expect("removed");
    let said = complaint(&ratelab(&["verify", &file]), 1);
    assert!(
        said.contains("actor.pt") && said.contains("found neither"),
        "{said}"
    );
}

/// The options for the timing of nodes.
const OF_TIME: [&[&str]; 6] = [
    &["--world", "own"],
    &["--takes", "policy=60..110", "--offset", "sensor=7.5"],
    &[
        "--world",
        "own",
        "--world-step-ms",
        "5",
        "--takes",
        "policy=busy 30",
    ],
    &[
        "--takes",
        "policy=lognormal:15,45",
        "--knob",
        "wakes actuator 0..3",
        "--seed",
        "7",
    ],
    &[
        "--world",
        "own",
        "--think-ms",
        "55",
        "--takes",
        "actuator=2",
        "--seed",
        "3",
    ],
    &["--world", "own", "--knobs", "KNOBS"],
];

#[test]
fn runs_with_tick_costs_are_reproduced() {
    let folder = folder();
    let knobs = path(&folder, "knobs");
    let turned = "1 takes policy 30..90\n2 offset sensor 13\n2.01 control-hz 25\n\
                  3 takes policy none\n3.5 wakes sensor 5\n4 offset sensor 0\n";
    fs::write(&knobs, turned).expect("written");
    for (place, args) in OF_TIME.iter().enumerate() {
        let args = args.iter().map(|arg| arg.replace("KNOBS", &knobs));
        let args: Vec<String> = args.collect();
        let args: Vec<&str> = args.iter().map(String::as_str).collect();
        let file = record(&folder, &format!("{place}.rrd"), &args);
        let output = ratelab(&["verify", &file]);
        assert!(output.status.success(), "{args:?}: {output:?}");
        let info = ratelab(&["info", &file]);
        assert!(info.status.success(), "{info:?}");
        assert!(text(&info.stdout).contains("world     "), "{info:?}");
    }
}

#[test]
fn durations_from_an_unchanged_recording_are_reproduced() {
    let folder = folder();
    let real = path(&folder, "real.rrd");
    let short = [
        "run",
        "--duration-s",
        "0.5",
        "--takes",
        "policy=30",
        "--record",
    ];
    let output = ratelab(&[&short[..], &[&real]].concat());
    assert!(output.status.success(), "{output:?}");
    let takes = format!("policy=recorded:{real}");
    let file = record(&folder, "drawn.rrd", &["--world", "own", "--takes", &takes]);
    assert!(ratelab(&["verify", &file]).status.success());
    // Other durations under the same name give another run.
    fs::remove_file(&real).expect("removed");
    let output = ratelab(&[&short[..], &[&real]].concat());
    assert!(output.status.success(), "{output:?}");
    let said = complaint(&ratelab(&["verify", &file]), 1);
    assert!(said.contains("other durations than it had"), "{said}");
}
