//! `ratelab exercise`, as used by learners and scripts.

mod support;

use std::process::{Command, Stdio};

use support::{Folder, Said, User};

/// A learner with a separate file of predictions.
struct Learner(Folder);

const ANSWERS: &str = "exercises/answers.toml";

impl Learner {
    fn new() -> Self {
        let clone = Folder::new();
        clone.write("exercises/bands.toml", "");
        Self(clone)
    }

    /// What is said to an answer to a question.
    fn predicts(&self, question: &str, prediction: &str) -> Said {
        self.says(&format!("{question} --predict '{prediction}'"))
    }

    /// The refusal of an answer to a question, of which nothing is shown.
    fn may_not_predict(&self, question: &str, prediction: &str) -> Said {
        self.refuses(&format!("{question} --predict '{prediction}'"))
    }
}

impl User for Learner {
    fn program(&self) -> Command {
        let mut program = self.0.program();
        program.arg("exercise");
        program
    }
}

#[test]
fn nothing_is_revealed_before_a_prediction() {
    let learner = Learner::new();
    for number in 1..=12 {
        let (said, shown) = learner.fails(&number.to_string(), 2);
        said.has("--predict");
        // Of a hidden fault there are figures to look at, and no word of what is mended.
        assert_eq!(shown.is_empty(), number != 10, "{number}");
        shown.lacks("mended  ");
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
        learner.may_not_predict("1", predicted);
    }
    assert!(!learner.0.path(ANSWERS).exists());
}

#[test]
fn a_prediction_is_kept_and_shown_beside_the_measurement() {
    let learner = Learner::new();
    let first = learner.predicts("1", "8 because half of 50 is plenty");
    first
        .has("10 Hz    3 of 3  501 501 501   50.0 ms")
        .has("You predicted 8 Hz: half of 50 is plenty.")
        .has("between 8 Hz and 7 Hz");
    assert_eq!(learner.says("1"), first, "not the same the second time");
    learner.says("").has("you predicted 8 Hz");
    // A second prediction is refused without `--redo`.
    let refused = learner.may_not_predict("1", "6 because I know now");
    refused.has("--redo");
    learner.refuses("1 --redo");
    learner
        .predicts("1 --redo", "6 because I know now")
        .has("You predicted 6 Hz")
        .has("Your first prediction is kept: 8 Hz, half of 50 is plenty");
    learner.says("").has("you predicted 6 Hz, first 8 Hz");
}

#[test]
fn an_exercise_without_a_learner_creates_no_folder() {
    let home = Folder::new();
    let mut command = home.command("exercise 1");
    let command = command
        .env("HOME", home.path(""))
        .env_remove("XDG_DATA_HOME");
    let output = command.output().expect("ratelab starts");
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    assert!(output.stdout.is_empty(), "{output:?}");
    assert!(home.names("").is_empty(), "{:?}", home.names(""));
}

#[test]
fn an_unwritable_file_of_predictions_is_refused_before_the_measurement() {
    let learner = Learner::new();
    learner.0.write("exercises/answers.toml.new/in-the-way", "");
    let refused = learner.may_not_predict("1", "8 because it is");
    refused.has("--answers FILE keeps them elsewhere");
}

#[test]
fn a_prediction_can_come_from_a_pipe() {
    let learner = Learner::new();
    let mut echo = Command::new("echo");
    let echo = echo
        .arg("3 because a deep queue loses nothing")
        .stdout(Stdio::piped());
    let said = echo.spawn().expect("echo").stdout.expect("piped");
    let output = learner
        .command("2")
        .stdin(said)
        .output()
        .expect("it starts");
    assert!(output.status.success(), "{output:?}");
    Said::of(&output.stdout)
        .has("You predicted 3")
        .has("Measured: 0");
}

#[test]
fn check_makes_all_promised_measurements() {
    let learner = Learner::new();
    let all = learner.says("check");
    let held = all.matches("measurements hold; no prediction yet, skipped");
    assert_eq!(held.count(), 18, "{all:?}");
    assert_eq!(learner.says("check 3").lines().count(), 1);
}

#[test]
fn check_keeps_measurements_and_the_prediction_apart() {
    let learner = Learner::new();
    for (predicted, told) in [
        ("13", "13 Hz was wrong. You were 5 Hz above it."),
        ("7.5", "7.5 Hz was right. You called it."),
    ] {
        learner.predicts("1 --redo", &format!("{predicted} because of it"));
        let checked = learner.says("check 1");
        let lines: Vec<&str> = checked.lines().map(str::trim).collect();
        let held = "✓ 1 The control-rate cliff: 71 measurements hold";
        assert_eq!(lines, [held, &format!("your prediction of {told}")]);
    }
}

#[test]
fn a_rescue_by_hand_is_judged_from_its_recording() {
    let learner = Learner::new();
    let folder = &learner.0;
    folder.copy(&[
        "recordings/balanced-50hz.rrd",
        "recordings/fall-5hz.rrd",
        "recordings/rescued.rrd",
        "recordings/rescue.knobs",
    ]);
    let record = |name: &str, knobs: &str| {
        folder.write("knobs", knobs);
        folder.says(&format!(
            "run --clock virtual --knobs knobs --record {name}"
        ));
    };
    // A rescue of one's own, by two knobs that are turned in time.
    record("own.rrd", "1 control-hz 5\n2.1 control-hz 50\n");
    let said = learner.says("5 --session own.rrd");
    assert!(said.starts_with('✓'), "{said:?}");
    said.has("rescued: slowed at 1.000 s for 1.10 s");
    // The rescue included with ratelab: with additional bytes, cut, and repeated.
    let mut shipped = folder.bytes("rescued.rrd");
    folder.write("shorter.rrd", &shipped[..shipped.len() * 9 / 10]);
    shipped.push(0);
    folder.write("longer.rrd", shipped);
    let knobs = folder.read("rescue.knobs");
    record("repeated.rrd", &knobs);
    // Almost at the same nanoseconds, and all of it a little later.
    record("nearly.rrd", &knobs.replace("34574", "34578"));
    let later = knobs.replace("0.995", "1.005").replace("2.116", "2.126");
    record("later.rrd", &later);
    let copied = ["record your own", "not a rescue yet"];
    for (name, whys) in [
        ("longer.rrd", &copied[..]),
        ("shorter.rrd", &copied),
        ("repeated.rrd", &copied),
        ("nearly.rrd", &copied),
        ("later.rrd", &copied),
        ("balanced-50hz.rrd", &["never slowed"]),
        ("fall-5hz.rrd", &["it fell at 0.840 s"]),
        ("rescued.rrd", &["comes with ratelab, record your own"]),
    ] {
        let output = learner.does(&format!("5 --session {name}"));
        let said = Said::of(&output.stdout);
        assert_eq!(output.status.code(), Some(1), "{name}: {said:?}");
        let refused = said.starts_with('✖') && whys.iter().any(|why| said.contains(why));
        assert!(refused, "{name}: {said:?}");
    }
    learner.refuses("2 --session rescued.rrd");
}

#[test]
fn rubbish_is_refused_in_one_line() {
    let learner = Learner::new();
    for line in [
        "0", "13", "one", "1 2", "check 99", "6e", "1a", "6bb", "check 6e", "6a 6b",
    ] {
        learner.refuses(line);
    }
    let refused = learner.may_not_predict("1", "8 because");
    refused.has("8 Hz is without a reason");
    learner.0.write(ANSWERS, "cliff = 8");
    let output = learner.does("1 --predict '8 because it is'");
    assert_eq!(output.status.code(), Some(2), "{output:?}");
}

#[test]
fn the_questions_of_an_exercise_come_one_after_the_other() {
    let learner = Learner::new();
    let first = learner.predicts("7", "20 because it is almost as fast");
    first
        .has("Exercise 7a")
        .has("Measured: between 5.2 s and 5.28 s")
        .lacks("Exercise 7b")
        .has("Next: ratelab exercise 7b");
    // What was answered is shown again; the next question is not, without a prediction.
    assert_eq!(learner.says("7"), first);
    learner
        .predicts("7", "9 because it drops the least")
        .lacks("Exercise 7a")
        .has("Exercise 7b")
        .has("You were 5 messages above it.")
        .has("Next: ratelab exercise 8");
    learner
        .may_not_predict("7", "4 because I know")
        .has("--redo");
    learner.says("7").has("Exercise 7a").has("Exercise 7b");
    learner
        .predicts("7 --redo", "5 because I know")
        .has("Exercise 7a");
    let list = learner.says("");
    assert_eq!(list.matches("you predicted").count(), 1, "{list:?}");
}

#[test]
fn each_listed_question_can_be_done_alone() {
    let learner = Learner::new();
    let list = learner.says("");
    let labels = list
        .lines()
        .map_while(|line| line.split_whitespace().next());
    let labels: Vec<&str> = labels.collect();
    assert_eq!(labels.len(), 18, "{labels:?}");
    // Each is there: without a prediction only that is missing.
    for label in &labels {
        let (said, _) = learner.fails(label, 2);
        said.has("no prediction yet");
    }
    let said = learner.predicts("7B", "4 because it is short");
    said.has("Exercise 7b")
        .lacks("Exercise 7a")
        .has("Next: ratelab exercise 7a");
    assert_eq!(learner.says("7b"), said);
    learner.may_not_predict("7b", "5 because it is deep");
    learner.predicts("7b --redo", "5 because it is deep");
    // The whole exercise goes on with the question that is left.
    let said = learner.predicts("7", "5.2 because it grows old");
    said.has("Exercise 7a").has("You called it.");
    assert_eq!(learner.says("check 7b").lines().count(), 2);
    for wrong in ["6e", "13"] {
        let said = learner.refuses(wrong);
        for label in &labels {
            said.has(label);
        }
    }
}

#[test]
fn a_hidden_fault_follows_from_the_number_of_the_learner() {
    let learner = Learner::new();
    let figures = |seed: &str| learner.fails(&format!("10 --seed {seed}"), 2).1;
    assert_eq!(figures("3"), figures("3"));
    assert_ne!(figures("3"), figures("4"));
    for (bad, why) in [
        ("policy", "expected one of sensor slow"),
        ("policy slow", "reason"),
        ("policy tired because of it", "expected one of sensor slow"),
        ("3 because of it", "expected one of sensor slow"),
        ("", "expected one of sensor slow"),
    ] {
        let (said, _) = learner.fails(&format!("10 --seed 3 --predict '{bad}'"), 2);
        said.has(why);
    }
    for seed in ["-1", "x", "1.5", "99999999999999999999999"] {
        learner.fails(&format!("10 --seed {seed}"), 2);
    }
    let said = learner.predicts("10 --seed 3", "actuator slow, I guess");
    said.has("You named actuator slow: with that mended it fell")
        .has("Drawn from your number, 3");
    // The number is kept with the prediction.
    assert_eq!(learner.says("10"), said);
    assert_eq!(learner.says("10 --seed 3"), said);
    learner.refuses_each(
        "",
        "10 --seed 4                             | about --seed 3: --redo
         1 --seed 4 --predict '8 because of it'  | the same for everyone
         --seed 4                                | --seed",
    );
    let checked = learner.says("check 10");
    checked.has("your prediction of actuator slow was wrong.");
}

#[test]
fn a_clock_with_a_wrong_line_says_where_it_differs() {
    Learner::new()
        .predicts("12", "20 because it is a period")
        .has("Measured: 19.9601 ms")
        .has("Not mended yet: at 30, 15, 12, 7 Hz")
        .has("mend-it");
}
