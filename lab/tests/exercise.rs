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
    for number in 1..=12 {
        let (said, shown) = learner.is_refused(&[&number.to_string()]);
        assert!(said.contains("--predict"), "{said}");
        // Of a hidden fault there are figures to look at, and no word of what is mended.
        assert!(if number == 10 {
            !shown.contains("mended  ")
        } else {
            shown.is_empty()
        });
    }
    for predicted in [
        "",
        "8",
        "eight because",
        "nan because it is",
        "8 because",
        "8 because x",
        "8 Hz",
        "700 ms because of it",
        "-1 because of it",
        "51 because of it",
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
        first.contains("10 Hz    3 of 3  501 501 501   50.0 ms"),
        "{first}"
    );
    assert!(
        first.contains("You predicted 8 Hz: half of 50 is plenty."),
        "{first}"
    );
    assert!(first.contains("between 8 Hz and 7 Hz"), "{first}");
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
    let kept = "Your first prediction is kept: 8 Hz, half of 50 is plenty";
    assert!(again.contains(kept), "{again}");
    assert!(
        learner
            .succeeds(&[])
            .contains("you predicted 6 Hz, first 8 Hz")
    );
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
        18,
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
            "your prediction of 13 Hz was wrong. You were 5 Hz above it.",
        ),
        ("7.5", "your prediction of 7.5 Hz was right. You called it."),
    ] {
        let prediction = format!("{predicted} because of it");
        learner.succeeds(&["1", "--redo", "--predict", &prediction]);
        let checked = learner.succeeds(&["check", "1"]);
        let lines: Vec<&str> = checked.lines().map(str::trim).collect();
        let held = "✓ 1 The control-rate cliff: 71 measurements hold";
        assert_eq!(lines, [held, told]);
    }
}

#[test]
fn a_rescue_by_hand_is_judged_from_its_recording() {
    let learner = Learner::new();
    // A rescue of one's own, by two knobs that are turned in time.
    let own = learner.0.path().join("own.rrd");
    let knobs = learner.0.path().join("own.knobs");
    let record = |text: &str, file: &PathBuf| {
        fs::write(&knobs, text).expect("written");
        let mut command = Command::new(env!("CARGO_BIN_EXE_ratelab"));
        command
            .args(["run", "--clock", "virtual", "--knobs"])
            .arg(&knobs);
        let output = command.arg("--record").arg(file).output().expect("starts");
        assert!(output.status.success(), "{output:?}");
    };
    record("1 control-hz 5\n2.1 control-hz 50\n", &own);
    // The rescue included with ratelab: with additional bytes, cut, and repeated.
    let [longer, shorter, repeated] =
        ["longer", "shorter", "repeated"].map(|name| learner.0.path().join(format!("{name}.rrd")));
    let mut shipped = fs::read(reference("rescued.rrd")).expect("read");
    fs::write(&shorter, &shipped[..shipped.len() * 9 / 10]).expect("written");
    shipped.push(0);
    fs::write(&longer, shipped).expect("written");
    let shipped_knobs = fs::read_to_string(reference("rescue.knobs")).expect("read");
    record(&shipped_knobs, &repeated);
    // Almost at the same nanoseconds, and all of it a little later.
    let nearly = learner.0.path().join("nearly.rrd");
    record(&shipped_knobs.replace("34574", "34578"), &nearly);
    let later = learner.0.path().join("later.rrd");
    let shifted = shipped_knobs
        .replace("0.995", "1.005")
        .replace("2.116", "2.126");
    record(&shifted, &later);
    let judged = |file: &str| {
        let output = learner.does(&["5", "--session", file]);
        (
            output.status.code(),
            String::from_utf8(output.stdout).expect("UTF-8"),
        )
    };
    let (code, said) = judged(&own.display().to_string());
    assert!(
        said.contains("rescued: slowed at 1.000 s for 1.10 s"),
        "{code:?} {said}"
    );
    assert!(said.starts_with('✓'), "{said}");
    for copy in [longer, shorter, repeated, nearly, later] {
        let (code, said) = judged(&copy.display().to_string());
        assert_eq!(code, Some(1), "{said}");
        assert!(
            said.contains("record your own") || said.contains("not a rescue yet"),
            "{said}"
        );
    }
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
    for args in [
        &["0"][..],
        &["13"],
        &["one"],
        &["1", "2"],
        &["check", "99"],
        &["6e"],
        &["1a"],
        &["6bb"],
        &["check", "6e"],
        &["6a", "6b"],
    ] {
        learner.is_refused(args);
    }
    let (said, _) = learner.is_refused(&["1", "--predict", "8 because"]);
    assert!(said.contains("8 Hz is without a reason"), "{said}");
    fs::write(learner.answers(), "cliff = 8").expect("written");
    let output = learner.does(&["1", "--predict", "8 because it is"]);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
}

#[test]
fn the_questions_of_an_exercise_come_one_after_the_other() {
    let learner = Learner::new();
    let first = learner.succeeds(&["7", "--predict", "20 because it is almost as fast"]);
    assert!(first.contains("Exercise 7a"), "{first}");
    assert!(
        first.contains("Measured: between 5.2 s and 5.28 s"),
        "{first}"
    );
    assert!(!first.contains("Exercise 7b") && first.contains("Next: ratelab exercise 7b"));
    // What was answered is shown again; the next question is not, without a prediction.
    let again = learner.succeeds(&["7"]);
    assert_eq!(again, first);
    let second = learner.succeeds(&["7", "--predict", "9 because it drops the least"]);
    assert!(!second.contains("Exercise 7a") && second.contains("Exercise 7b"));
    assert!(second.contains("You were 5 messages above it."), "{second}");
    assert!(second.contains("Next: ratelab exercise 8"), "{second}");
    let (said, shown) = learner.is_refused(&["7", "--predict", "4 because I know"]);
    assert!(said.contains("--redo") && shown.is_empty(), "{said}");
    let both = learner.succeeds(&["7"]);
    assert!(both.contains("Exercise 7a") && both.contains("Exercise 7b"));
    let redone = learner.succeeds(&["7", "--redo", "--predict", "5 because I know"]);
    assert!(redone.contains("Exercise 7a"), "{redone}");
    let list = learner.succeeds(&[]);
    assert_eq!(list.matches("you predicted").count(), 1, "{list}");
}

#[test]
fn each_listed_question_can_be_done_alone() {
    let learner = Learner::new();
    let list = learner.succeeds(&[]);
    let labels = list
        .lines()
        .map_while(|line| line.split_whitespace().next());
    let labels: Vec<String> = labels.map(str::to_owned).collect();
    assert_eq!(labels.len(), 18, "{labels:?}");
    // Each is there: without a prediction only that is missing.
    for label in &labels {
        let (said, _) = learner.is_refused(&[label]);
        assert!(said.contains("no prediction yet"), "{label}: {said}");
    }
    let said = learner.succeeds(&["7B", "--predict", "4 because it is short"]);
    assert!(
        said.contains("Exercise 7b") && !said.contains("Exercise 7a"),
        "{said}"
    );
    assert!(said.contains("Next: ratelab exercise 7a"), "{said}");
    assert_eq!(learner.succeeds(&["7b"]), said);
    learner.is_refused(&["7b", "--predict", "5 because it is deep"]);
    learner.succeeds(&["7b", "--redo", "--predict", "5 because it is deep"]);
    // The whole exercise goes on with the question that is left.
    let said = learner.succeeds(&["7", "--predict", "5.2 because it grows old"]);
    assert!(
        said.contains("Exercise 7a") && said.contains("You called it."),
        "{said}"
    );
    assert_eq!(learner.succeeds(&["check", "7b"]).lines().count(), 2);
    for wrong in ["6e", "13"] {
        let (said, _) = learner.is_refused(&[wrong]);
        assert!(
            labels.iter().all(|label| said.contains(label.as_str())),
            "{said}"
        );
    }
}

#[test]
fn a_hidden_fault_follows_from_the_number_of_the_learner() {
    let learner = Learner::new();
    let figures = |seed: &str| learner.is_refused(&["10", "--seed", seed]).1;
    assert_eq!(figures("3"), figures("3"));
    assert_ne!(figures("3"), figures("4"));
    for bad in [
        "policy",
        "policy slow",
        "policy tired because of it",
        "3 because of it",
        "",
    ] {
        let (said, _) = learner.is_refused(&["10", "--seed", "3", "--predict", bad]);
        assert!(
            said.contains("expected one of sensor slow") || said.contains("reason"),
            "{said}"
        );
    }
    for seed in ["-1", "x", "1.5", "99999999999999999999999"] {
        learner.is_refused(&["10", "--seed", seed]);
    }
    let said = learner.succeeds(&["10", "--seed", "3", "--predict", "actuator slow, I guess"]);
    assert!(
        said.contains("You named actuator slow: with that mended it fell"),
        "{said}"
    );
    assert!(said.contains("Drawn from your number, 3"), "{said}");
    // The number is kept with the prediction.
    assert_eq!(learner.succeeds(&["10"]), said);
    assert_eq!(learner.succeeds(&["10", "--seed", "3"]), said);
    let (said, _) = learner.is_refused(&["10", "--seed", "4"]);
    assert!(said.contains("about --seed 3: --redo"), "{said}");
    let (said, _) = learner.is_refused(&["1", "--seed", "4", "--predict", "8 because of it"]);
    assert!(said.contains("the same for everyone"), "{said}");
    learner.is_refused(&["--seed", "4"]);
    let checked = learner.succeeds(&["check", "10"]);
    assert!(
        checked.contains("your prediction of actuator slow was wrong."),
        "{checked}"
    );
}

#[test]
fn a_clock_with_a_wrong_line_says_where_it_differs() {
    let learner = Learner::new();
    let said = learner.succeeds(&["12", "--predict", "20 because it is a period"]);
    for part in [
        "Measured: 19.9601 ms",
        "Not mended yet: at 30, 15, 12, 7 Hz",
        "mend-it",
    ] {
        assert!(said.contains(part), "{said}");
    }
}
