//! `ratelab exercise`, as used by learners and scripts.

mod support;

use std::{
    fs,
    path::PathBuf,
    process::{Command, Output, Stdio},
};

use tempfile::TempDir;

use support::reference;

/// A learner with a separate file of predictions.
struct Learner(TempDir);

impl Learner {
    fn new() -> Self {
        let clone = TempDir::new().expect("a folder");
        let folder = clone.path().join("exercises");
        fs::create_dir(&folder).expect("a folder");
        fs::write(folder.join("bands.toml"), "").expect("written");
        Self(clone)
    }

    fn answers(&self) -> PathBuf {
        self.0.path().join("exercises/answers.toml")
    }

    fn does(&self, args: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_ratelab"));
        command.arg("exercise").args(args);
        command.current_dir(self.0.path()).stdin(Stdio::null());
        command.output().expect("ratelab starts")
    }

    fn succeeds(&self, args: &[&str]) -> String {
        let output = self.does(args);
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stdout).expect("UTF-8")
    }

    fn is_refused(&self, args: &[&str]) -> (String, String) {
        let output = self.does(args);
        assert_eq!(output.status.code(), Some(2), "{output:?}");
        let said = String::from_utf8(output.stderr).expect("UTF-8");
        assert_eq!(said.lines().count(), 1, "{said}");
        (said, String::from_utf8(output.stdout).expect("UTF-8"))
    }
}

#[test]
fn nothing_is_revealed_before_a_prediction() {
    let learner = Learner::new();
    for number in ["1", "2", "3", "4", "5"] {
        let (said, shown) = learner.is_refused(&[number]);
        assert!(said.contains("--predict"), "{said}");
        assert_eq!(shown, "");
    }
    for predicted in [
        "",
        "8",
        "eight because",
        "nan because it is",
        "8 because",
        "8 Hz",
        "700 ms because so",
        "-1 because so",
        "51 because so",
    ] {
        let (_, shown) = learner.is_refused(&["1", "--predict", predicted]);
        assert_eq!(shown, "", "{predicted}");
    }
    assert!(!learner.answers().exists());
}

#[test]
fn a_prediction_is_kept_and_shown_beside_the_measurement() {
    let learner = Learner::new();
    let first = learner.succeeds(&["1", "--predict", "8 because half of 50 is plenty"]);
    assert!(
        first.contains("10 Hz    3 of 3  501 501 501       39.9 ms"),
        "{first}"
    );
    assert!(
        first.contains("You predicted 8 Hz: half of 50 is plenty."),
        "{first}"
    );
    assert!(first.contains("between 10 Hz and 5 Hz"), "{first}");
    assert_eq!(
        learner.succeeds(&["1"]),
        first,
        "not the same the second time"
    );
    assert!(learner.succeeds(&[]).contains("you predicted 8 Hz"));
    // A second prediction is refused without `--redo`.
    let (said, _) = learner.is_refused(&["1", "--predict", "6 because I know now"]);
    assert!(said.contains("--redo"), "{said}");
    learner.is_refused(&["1", "--redo"]);
    let again = learner.succeeds(&["1", "--redo", "--predict", "6 because I know now"]);
    assert!(again.contains("You predicted 6 Hz"), "{again}");
}

#[test]
fn an_exercise_without_a_learner_creates_no_folder() {
    let home = TempDir::new().expect("a folder");
    let mut command = Command::new(env!("CARGO_BIN_EXE_ratelab"));
    command.args(["exercise", "1"]).stdin(Stdio::null());
    command.env("HOME", home.path()).env_remove("XDG_DATA_HOME");
    let output = command.current_dir(home.path()).output();
    let output = output.expect("ratelab starts");
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    assert!(output.stdout.is_empty(), "{output:?}");
    let left: Vec<_> = home.path().read_dir().expect("folder").collect();
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn an_unwritable_file_of_predictions_is_refused_before_the_measurement() {
    let learner = Learner::new();
    let in_the_way = learner.answers().with_extension("toml.new");
    fs::create_dir(in_the_way).expect("a folder");
    let (said, shown) = learner.is_refused(&["1", "--predict", "8 because it is"]);
    assert_eq!(shown, "");
    assert!(
        said.contains("--answers FILE keeps them elsewhere"),
        "{said}"
    );
}

#[test]
fn a_prediction_can_come_from_a_pipe() {
    let learner = Learner::new();
    let script = format!(
        "echo '3 because a deep queue loses nothing' | {} exercise 2",
        env!("CARGO_BIN_EXE_ratelab")
    );
    let mut sh = Command::new("sh");
    let output = sh
        .args(["-c", &script])
        .current_dir(learner.0.path())
        .output();
    let output = output.expect("sh starts");
    assert!(output.status.success(), "{output:?}");
    let said = String::from_utf8(output.stdout).expect("UTF-8");
    assert!(
        said.contains("You predicted 3") && said.contains("Measured: 0"),
        "{said}"
    );
}

#[test]
fn check_makes_all_promised_measurements() {
    let learner = Learner::new();
    let all = learner.succeeds(&["check"]);
    assert_eq!(
        all.matches("measurements hold; no prediction yet, skipped")
            .count(),
        5,
        "{all}"
    );
    assert_eq!(learner.succeeds(&["check", "3"]).lines().count(), 1);
}

#[test]
fn check_keeps_measurements_and_the_prediction_apart() {
    let learner = Learner::new();
    for (predicted, told) in [
        (
            "13",
            "your prediction of 13 Hz was wrong. You were 3 Hz above it.",
        ),
        ("8", "your prediction of 8 Hz was right. You called it."),
    ] {
        let prediction = format!("{predicted} because so");
        learner.succeeds(&["1", "--redo", "--predict", &prediction]);
        let checked = learner.succeeds(&["check", "1"]);
        let lines: Vec<&str> = checked.lines().map(str::trim).collect();
        let held = "✓ 1 The control-rate cliff: 43 measurements hold";
        assert_eq!(lines, [held, told]);
    }
}

#[test]
fn a_rescue_by_hand_is_judged_from_its_recording() {
    let learner = Learner::new();
    // The rescue included with ratelab, with additional bytes after its last message.
    let own = learner.0.path().join("own.rrd");
    let mut rescued = fs::read(reference("rescued.rrd")).expect("read");
    rescued.push(0);
    fs::write(&own, rescued).expect("written");
    let judged = |file: &str| {
        let output = learner.does(&["5", "--session", file]);
        (
            output.status.code(),
            String::from_utf8(output.stdout).expect("UTF-8"),
        )
    };
    let (code, said) = judged(&own.display().to_string());
    assert!(
        said.contains("rescued: slowed at 0.995 s for 1.12 s"),
        "{code:?} {said}"
    );
    assert!(said.starts_with('✓'), "{said}");
    for (name, why) in [
        ("balanced-50hz.rrd", "never slowed"),
        ("fall-5hz.rrd", "it fell at 0.840 s"),
        ("rescued.rrd", "comes with ratelab, record your own"),
    ] {
        let (code, said) = judged(&reference(name));
        assert_eq!(code, Some(1), "{said}");
        assert!(said.starts_with('✖') && said.contains(why), "{said}");
    }
    learner.is_refused(&["2", "--session", &reference("rescued.rrd")]);
}

#[test]
fn rubbish_is_refused_in_one_line() {
    let learner = Learner::new();
    for args in [&["0"][..], &["6"], &["one"], &["1", "2"], &["check", "9"]] {
        learner.is_refused(args);
    }
    fs::write(learner.answers(), "cliff = 8").expect("written");
    let (said, _) = learner.is_refused(&["1", "--predict", "8 because"]);
    assert!(said.contains("8 Hz is a number without a reason"), "{said}");
    let output = learner.does(&["1", "--predict", "8 because it is"]);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
}
