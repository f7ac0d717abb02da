//! `ratelab verify`, as used on the command line: identical runs, different runs, and the
//! reasons.

mod support;

use std::fs;

use support::{Folder, User};

/// Records a virtual run to `run.rrd` and verifies it.
#[track_caller]
fn record(folder: &Folder, options: &str) {
    let run = format!("run --clock virtual --record run.rrd {options}");
    folder.says(&run).has("recorded  ");
    folder.says("verify run.rrd").has("identical");
}

#[test]
fn the_reference_recordings_are_reproduced_and_match_their_readme() {
    for (name, identical, info) in [
        ("balanced-50hz.rrd", "1,503 messages", "mean 0.0 ms"),
        ("fall-5hz.rrd", "91 messages", "FELL at 0.840 s"),
        (
            "rescued.rrd",
            "1,004 messages",
            "knob      2.116662647 control-hz 25",
        ),
    ] {
        let folder = Folder::with(&[&format!("recordings/{name}")]);
        let verified = folder.says(&format!("verify {name}"));
        verified.has(&format!("identical, 3 topics, {identical}"));
        folder.says(&format!("info {name}")).has(info);
    }
}

#[test]
fn a_real_clock_recording_is_verified_however_its_threads_are_scheduled() {
    let folder = Folder::new();
    folder.says("run --duration-s 0.5 --record real.rrd");
    folder.says("verify real.rrd").has("identical");
    folder.says("verify --perturb real.rrd").has("identical");
    folder.says("info real.rrd");
}

#[test]
fn a_command_that_is_carried_out_after_the_end_of_the_run_is_a_part_of_the_recording() {
    let folder = Folder::new();
    // Due just before the end: a thread is awake for it only after the end.
    let late = ["takes policy 1", "queue-depth 3", "sensor-hz 30"];
    folder.write(
        "late.knobs",
        late.map(|knob| format!("0.0999999 {knob}\n")).concat(),
    );
    for number in 0..3 {
        folder.says(&format!(
            "run --duration-s 0.1 --knobs late.knobs --record {number}.rrd"
        ));
        folder.says(&format!("verify {number}.rrd"));
    }
}

#[test]
fn a_branch_of_a_fall_stays_up_without_what_made_it_fall() {
    let folder = Folder::new();
    folder.says("run --think-ms 230 --duration-s 2 --record fall.rrd");
    let branch = "branch fall.rrd --at 0.2 --knob 'takes policy 0'";
    let printed = folder.says(branch);
    for part in ["last rest", "FELL at", "BALANCED", "on: balanced"] {
        printed.has(part);
    }
    // The branch is a recording, too.
    let recorded = folder.says(&format!("{branch} --record branch.rrd"));
    recorded.has("recorded");
    let info = folder.says("info branch.rrd");
    for part in ["BALANCED", "on to the virtual clock", "think-ms none"] {
        info.has(part);
    }
    folder.says("verify branch.rrd").has("identical");
    // So it can be left in its turn.
    let again = folder.says("branch branch.rrd --at 0.4 --knob 'takes policy 250'");
    again.has("branch    FELL");
    folder.refuses_each(
        "branch fall.rrd --at",
        "9 --knob 'takes policy 0'                    | choose an earlier moment
         0.2 --knob 'takes nobody 0'                  | expected one of sensor, policy
         0.2 --knob 'rate policy 5' --duration-s 0.1  | choose a later end",
    );
}

#[test]
fn a_branch_at_the_end_of_a_run_goes_on_for_some_seconds() {
    let folder = Folder::new();
    folder.says("run --clock virtual --duration-s 1 --record short.rrd");
    let branch = folder.says("branch short.rrd --at 1 --knob 'takes policy 250'");
    branch.has("branch    FELL");
}

#[test]
fn all_of_several_recordings_are_verified_even_after_a_failure() {
    let folder = Folder::with(&["recordings/fall-5hz.rrd"]);
    folder.write("bad.rrd", "");
    let output = folder.does("verify bad.rrd fall-5hz.rrd");
    support::Said::of(&output.stdout).has("fall-5hz.rrd: identical");
    let said = support::Said::of(&output.stderr);
    said.has("bad.rrd: ").has("1 of 2");
    assert_eq!(output.status.code(), Some(1));
}

#[test]
fn a_run_that_swaps_policies_is_verified_and_a_changed_policy_is_named() {
    let policies = ["actor.pt", "half.pt"].map(|name| format!("tests/fixtures/policies/{name}"));
    let folder = Folder::with(&policies.each_ref().map(String::as_str));
    let policy = folder.path("actor.pt");
    let swaps = format!(
        "0.5 policy lqr\n1 policy {}\n1.1 policy scripted\n",
        policy.display()
    );
    folder.write("swaps.knobs", swaps);
    record(&folder, "--knobs swaps.knobs");
    let verify = || folder.fails("verify run.rrd", 1).0;
    fs::copy(folder.path("half.pt"), &policy).expect("copied");
    verify().has("actor.pt").has("SHA-256");
    fs::remove_file(&policy).expect("removed");
    verify().has("actor.pt").has("found neither");
}

#[test]
fn runs_with_tick_costs_are_reproduced() {
    for options in [
        "--world own",
        "--takes policy=60..110 --offset sensor=7.5",
        "--world own --world-step-ms 5 --takes 'policy=busy 30'",
        "--takes policy=lognormal:15,45 --knob 'wakes actuator 0..3' --seed 7",
        "--world own --think-ms 55 --takes actuator=2 --seed 3",
        "--world own --knobs knobs",
    ] {
        let folder = Folder::new();
        let turned = "1 takes policy 30..90\n2 offset sensor 13\n2.01 control-hz 25\n\
                      3 takes policy none\n3.5 wakes sensor 5\n4 offset sensor 0\n";
        folder.write("knobs", turned);
        record(&folder, options);
        folder.says("info run.rrd").has("world     ");
    }
}

#[test]
fn durations_from_an_unchanged_recording_are_reproduced() {
    let folder = Folder::new();
    let real = "run --duration-s 0.5 --takes policy=30 --record real.rrd";
    folder.says(real);
    record(&folder, "--world own --takes policy=recorded:real.rrd");
    // Other durations under the same name give another run.
    fs::remove_file(folder.path("real.rrd")).expect("removed");
    folder.says(real);
    let (said, _) = folder.fails("verify run.rrd", 1);
    said.has("other durations than it had");
}
