//! `ratelab grade`: the hand-ins of a class.

mod support;

use std::fs;

use serde_json::Value;
use tempfile::TempDir;

use support::{complaint, folder, path, ratelab, reference, text};

/// A rescue by hand: the run times at which the policy was slowed and made fast again (s).
fn knobs(slowed: f64, fast: f64) -> String {
    format!("{slowed:.9} control-hz 5\n{fast:.9} control-hz 25\n")
}

/// A class with a folder per learner.
struct Class(TempDir);

impl Class {
    fn new() -> Self {
        Self(folder())
    }

    fn dir(&self) -> String {
        self.0.path().display().to_string()
    }

    /// Writes a file of a learner.
    fn hands_in(&self, learner: &str, file: &str, content: impl AsRef<[u8]>) {
        let folder = self.0.path().join(learner);
        fs::create_dir_all(&folder).expect("folder");
        fs::write(folder.join(file), content).expect("written");
    }

    /// Predictions for the first two exercises.
    fn predicts(&self, learner: &str, [rate, saved]: [u32; 2], reason: &str) {
        let answers = format!(
            "[cliff]\nnumber = {rate}\nreason = \"{reason}\"\n\
             [deeper-queue]\nnumber = {saved}\nreason = \"{reason}\"\n"
        );
        self.hands_in(learner, "answers.toml", answers);
    }

    /// Records a rescue with these knobs.
    fn rescues(&self, learner: &str, seed: u32, knobs: &str) {
        let folder = self.0.path().join(learner);
        fs::create_dir_all(&folder).expect("folder");
        let aside = support::folder();
        let file = path(&aside, "hands.knobs");
        fs::write(&file, knobs).expect("written");
        let recording = folder.join("rescue.rrd").display().to_string();
        let seed = seed.to_string();
        let args = [
            "run", "--clock", "virtual", "--seed", &seed, "--knobs", &file,
        ];
        let output = ratelab(&[&args[..], &["--record", &recording]].concat());
        assert!(output.status.success(), "{output:?}");
    }
}

#[test]
fn thirty_hand_ins_are_graded_in_one_command_and_two_copies_are_found() {
    let class = Class::new();
    for number in 0..30 {
        let reason = format!("learner {number} says so");
        class.predicts(
            &format!("learner-{number:02}"),
            [number, number % 4],
            &reason,
        );
    }
    for number in 0..6 {
        let late = f64::from(number + 1) * 1e-3;
        let knobs = knobs(0.995_434_574 + late, 2.116_662_647 + late);
        class.rescues(&format!("learner-{number:02}"), 0, &knobs);
    }
    // One copies the file, the other records the commands of another again.
    let original = fs::read(class.0.path().join("learner-02/rescue.rrd")).expect("recorded");
    class.hands_in("learner-20", "mine.rrd", original);
    class.rescues("learner-21", 0, &knobs(0.999_434_574, 2.120_662_647));

    let csv = path(&class.0, "grades.csv");
    let output = ratelab(&["grade", &class.dir(), "--csv", &csv]);
    let told = complaint(&output, 1);
    assert_eq!(told, "error: 4 of 30 hand-ins are not acceptable\n");
    let table = text(&output.stdout);
    for line in [
        "hand-ins  30, 26 acceptable",
        "✖ learner-02/rescue.rrd: the same session as learner-20/mine.rrd",
        "✖ learner-20/mine.rrd: the same session as learner-02/rescue.rrd",
        "✖ learner-03/rescue.rrd: the same session as learner-21/rescue.rrd",
        "✖ learner-21/rescue.rrd: the same session as learner-03/rescue.rrd",
        "✓ learner-07: 7 Hz, learner 7 says so",
        "✖ learner-12: 12 Hz, learner 12 says so",
    ] {
        assert!(table.contains(line), "{line:?} is missing in\n{table}");
    }
    assert_eq!(table.matches("the same session as").count(), 4, "{table}");
    let rows = fs::read_to_string(csv).expect("written");
    assert_eq!(rows.lines().count(), 1 + 2 * 30 + 8, "{rows}");
    assert!(
        rows.contains("learner-07,true,exercise 1,true,7,Hz,learner 7 says so,\n"),
        "{rows}"
    );

    let output = ratelab(&["grade", &class.dir(), "--json"]);
    let graded: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let hand_ins = graded["hand_ins"].as_array().expect("a list");
    let accepted = hand_ins
        .iter()
        .filter(|hand_in| hand_in["accepted"] == true);
    assert_eq!(accepted.count(), 26);
    let session = &hand_ins[0]["sessions"][0];
    let verified = session["verified"].as_str().expect("verified");
    assert!(verified.starts_with("identical, 3 topics"), "{session}");
}

#[test]
fn what_is_not_acceptable_is_named_with_its_reason_and_the_others_are_graded() {
    let class = Class::new();
    class.predicts("anna", [8, 0], "half of the rate is still plenty");
    class.predicts("bert", [20, 0], "Half of the rate is still plenty!");
    class.hands_in("carl", "answers.toml", "cliff = 8");
    fs::create_dir(class.0.path().join("dora")).expect("folder");
    for (learner, name) in [
        ("emil", "rescued.rrd"),
        ("fred", "balanced-50hz.rrd"),
        ("gina", "fall-5hz.rrd"),
    ] {
        class.hands_in(learner, "own.rrd", fs::read(reference(name)).expect("read"));
    }
    let shipped = fs::read(reference("rescued.rrd")).expect("read");
    class.hands_in("hans", "cut.rrd", &shipped[..shipped.len() / 2]);
    class.hands_in("ida", "own.rrd", "no recording");
    class.hands_in(
        "\u{1b}[31mjo",
        "answers.toml",
        "[cliff]\nnumber = 8\nreason = \"\u{9b}2J so\"",
    );
    let output = ratelab(&["grade", &class.dir()]);
    let told = complaint(&output, 1);
    assert_eq!(told, "error: 7 of 10 hand-ins are not acceptable\n");
    let table = text(&output.stdout);
    for line in [
        "✖ bert: 20 Hz, Half of the rate is still plenty! (the words of anna)",
        "✖ carl: answers.toml: line 1: ",
        "✖ dora: nothing is handed in",
        "✖ emil/own.rrd: comes with ratelab",
        "✖ fred/own.rrd: no rescue: ",
        "✖ gina/own.rrd: no rescue: ",
        "✖ hans/cut.rrd: nothing in this recording is whole: it ends",
        "✖ ida/own.rrd: this is not a rerun recording",
    ] {
        assert!(table.contains(line), "{line:?} is missing in\n{table}");
    }
    assert!(!table.contains(['\u{1b}', '\u{9b}']), "{table:?}");
}

#[test]
fn wrong_predictions_are_acceptable() {
    let class = Class::new();
    class.predicts("anna", [50, 3], "any rate below that of the sensor loses");
    let output = ratelab(&["grade", &class.dir()]);
    assert!(output.status.success(), "{output:?}");
    let table = text(&output.stdout);
    assert!(table.contains("0 of 2"), "{table}");
}

#[test]
fn a_folder_without_hand_ins_is_bad_input() {
    let empty = folder();
    for dir in [
        path(&empty, ""),
        path(&empty, "none"),
        reference("fall-5hz.rrd"),
    ] {
        let output = ratelab(&["grade", &dir]);
        complaint(&output, 2);
        assert!(output.stdout.is_empty());
    }
}

#[test]
fn questions_drawn_from_a_number_are_graded_with_that_number() {
    let mut questions = exercises::questions();
    let drawn = questions.find(|question| question.draws() && !question.brief().choices.is_empty());
    let brief = drawn.expect("a question with choices").brief();
    let class = Class::new();
    for seed in [1, 2] {
        for (number, _) in (1..).zip(brief.choices) {
            let name = brief.name;
            let answer = format!(
                "[{name}]\nnumber = {number}\nreason = \"it looked like it\"\nseed = {seed}\n"
            );
            class.hands_in(&format!("seat-{seed}-{number:02}"), "answers.toml", answer);
        }
    }
    let output = ratelab(&["grade", &class.dir(), "--json"]);
    assert!(output.status.success(), "{output:?}");
    let graded: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let hand_ins = graded["hand_ins"].as_array().expect("a list").iter();
    let marks: Vec<&Value> = hand_ins.map(|hand_in| &hand_in["predictions"][0]).collect();
    for seed in [1, 2] {
        let right = marks
            .iter()
            .filter(|mark| mark["seed"] == seed && mark["right"] == true);
        assert_eq!(right.count(), 1, "number {seed}");
    }
    let table = text(&ratelab(&["grade", &class.dir()]).stdout);
    assert!(table.contains("drawn from the learner's number"), "{table}");
}
