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
        // No two hands are at it for as long.
        let late = f64::from(number + 1);
        let knobs = knobs(0.995_434_574 + 13e-3 * late, 2.116_662_647 + 7e-3 * late);
        class.rescues(&format!("learner-{number:02}"), 0, &knobs);
    }
    // One copies the file, one records the commands of another again, almost at the same
    // nanoseconds, and one a little later.
    let original = fs::read(class.0.path().join("learner-02/rescue.rrd")).expect("recorded");
    class.hands_in("learner-20", "mine.rrd", original);
    let of_another = [0.995_434_574 + 52e-3, 2.116_662_647 + 28e-3];
    for (learner, later) in [("learner-21", 4e-9), ("learner-22", 5e-3)] {
        let [slowed, fast] = of_another.map(|at| at + later);
        class.rescues(learner, 0, &knobs(slowed, fast));
    }

    let csv = path(&class.0, "grades.csv");
    let output = ratelab(&["grade", &class.dir(), "--csv", &csv]);
    // Nobody knows who copied from whom: both are named, and nobody is refused.
    assert!(output.status.success(), "{output:?}");
    let table = text(&output.stdout);
    for line in [
        "hand-ins  30, 30 acceptable",
        "? learner-02 rescue.rrd: the same session as learner-20/mine.rrd",
        "? learner-20 mine.rrd: the same session as learner-02/rescue.rrd",
        "? learner-03 rescue.rrd: the same session as learner-21/rescue.rrd, learner-22/rescue.rrd",
        "? learner-21 rescue.rrd: the same session as learner-03/rescue.rrd, learner-22/rescue.rrd",
        "? learner-22 rescue.rrd: the same session as learner-03/rescue.rrd, learner-21/rescue.rrd",
        "? learner-00 rescue.rrd: played from a list of knobs and not by hand",
        "✓ learner-07: 7 Hz, learner 7 says so",
        "✖ learner-12: 12 Hz, learner 12 says so",
    ] {
        assert!(table.contains(line), "{line:?} is missing in\n{table}");
    }
    assert_eq!(table.matches("the same session as").count(), 5, "{table}");
    let rows = fs::read_to_string(csv).expect("written");
    assert_eq!(rows.lines().count(), 1 + 2 * 30 + 9, "{rows}");
    assert!(
        rows.contains("learner-07,true,exercise 1,true,7,Hz,learner 7 says so,,,without a mark"),
        "{rows}"
    );

    let output = ratelab(&["grade", &class.dir(), "--json"]);
    let graded: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let hand_ins = graded["hand_ins"].as_array().expect("a list");
    let accepted = hand_ins
        .iter()
        .filter(|hand_in| hand_in["accepted"] == true);
    assert_eq!(accepted.count(), 30);
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

/// Does an exercise as a learner does, and returns the text of the file.
fn predicts(class: &Class, learner: &str, args: &[&str]) -> String {
    let folder = class.0.path().join(learner);
    fs::create_dir_all(&folder).expect("folder");
    let file = folder.join("answers.toml").display().to_string();
    let output = ratelab(&[&["exercise", "--answers", &file][..], args].concat());
    assert!(output.status.success(), "{output:?}");
    fs::read_to_string(file).expect("written")
}

/// The rows of the CSV file, by column.
fn rows(class: &Class, args: &[&str]) -> Vec<Value> {
    let csv = path(&class.0, "grades.csv");
    let output = ratelab(&[&["grade", &class.dir(), "--csv", &csv][..], args].concat());
    assert!(output.status.success(), "{output:?}");
    let text = fs::read_to_string(csv).expect("written");
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let head = lines.next().expect("a head");
    let row = |cells: Vec<&str>| {
        assert_eq!(cells.len(), head.len(), "{cells:?}");
        let cells = head.iter().zip(cells);
        cells
            .map(|(name, cell)| ((*name).to_owned(), cell.into()))
            .collect()
    };
    lines.map(|cells| Value::Object(row(cells))).collect()
}

/// Learners, the options of what they did, and for exercise 1 whether they are right; then
/// the flags of that, with a part of the evidence.
type Hiding<'a> = (&'a str, &'a [&'a str], &'a str, &'a [(&'a str, &'a str)]);

const PLAYED: [Hiding<'_>; 10] = [
    (
        "s1",
        &["1", "7.5 because the pole is slow"],
        "true",
        &[("copied_reason", "the words of s12")],
    ),
    (
        "s2",
        &["1", "20 because it is fast"],
        "false",
        &[("copied_reason", "the entry of s10")],
    ),
    ("s10", &[], "false", &[("copied_reason", "the entry of s2")]),
    (
        "s11",
        &[],
        "true",
        &[("edited", "changed after ratelab wrote it")],
    ),
    (
        "s12",
        &["1", "9 because the pole is slow"],
        "false",
        &[("copied_reason", "the words of s1")],
    ),
    (
        "s13",
        &["1", "30 because nobody knows it"],
        "false",
        &[("redone", "later 7.5 Hz")],
    ),
    (
        "s14",
        &[],
        "true",
        &[("edited", "without a mark"), ("no_reason", "is no reason")],
    ),
    ("s15", &["1", "40 because of the sensor"], "false", &[]),
    (
        "s16",
        &["10", "policy slow because it looks so", "--seed", "3"],
        "",
        &[],
    ),
    (
        "s17",
        &["10", "policy slow because I guess so", "--seed", "3"],
        "",
        &[("foreign_seed", "about number 3 of s16; the roster has 4")],
    ),
];

/// The class of [`PLAYED`], with its roster.
fn a_class_with_secrets() -> (Class, String) {
    let class = Class::new();
    for (learner, did, ..) in PLAYED {
        if let [number, text, more @ ..] = did {
            predicts(
                &class,
                learner,
                &[&[number, "--predict", text][..], more].concat(),
            );
        }
    }
    let again = ["1", "--redo", "--predict", "7.5 because I saw it"];
    predicts(&class, "s13", &again);
    let original = class.0.path().join("s2/answers.toml");
    let original = fs::read_to_string(original).expect("written");
    class.hands_in("s10", "answers.toml", &original);
    class.hands_in("s11", "answers.toml", original.replace("20.0", "7.5"));
    let by_hand = "[cliff]\nnumber = 7.5\nreason = \"x\"";
    class.hands_in("s14", "answers.toml", by_hand);
    let roster = path(&class.0, "roster.csv");
    fs::write(&roster, "name,number\ns16,3\ns17,4\ns18,5\n").expect("written");
    (class, roster)
}

#[test]
fn what_a_prediction_hides_is_flagged_with_its_evidence_and_the_first_one_counts() {
    let (class, roster) = a_class_with_secrets();
    let rows = rows(&class, &["--roster", &roster]);
    assert_eq!(rows.len(), PLAYED.len());
    // In the order of people.
    for (row, (learner, _, right, flags)) in rows.iter().zip(PLAYED) {
        assert_eq!(row["learner"], learner);
        assert!(right.is_empty() || row["right"] == right, "{row}");
        for flag in [
            "copied_reason",
            "edited",
            "foreign_seed",
            "redone",
            "no_reason",
        ] {
            let said = row[flag].as_str().expect("a column");
            match flags.iter().find(|(name, _)| *name == flag) {
                Some((_, why)) => assert!(said.contains(why), "{learner} {flag}: {said}"),
                None => assert_eq!(said, "", "{learner} {flag}"),
            }
        }
    }
}

#[test]
fn the_table_counts_each_question_and_lists_what_to_look_at() {
    let (class, roster) = a_class_with_secrets();
    let table = text(&ratelab(&["grade", &class.dir(), "--roster", &roster]).stdout);
    for line in [
        "hand-ins  10, 10 acceptable, 8 to look at",
        "roster    3, without a hand-in: s18",
        "learner  1 control rate Hz  10 culprit",
        "  3 of 8 right",
        "  ? s11 1: changed after ratelab wrote it",
        "  ? s17 10: about number 3 of s16; the roster has 4",
    ] {
        assert!(table.contains(line), "{line:?} is missing in\n{table}");
    }
    let mut lines = table.lines();
    assert!(lines.all(|line| line.chars().count() <= 80), "{table}");
    // Without a roster it is said that nobody looked.
    let table = text(&ratelab(&["grade", &class.dir()]).stdout);
    assert!(
        table.contains("numbers   as each hand-in has it, unchecked"),
        "{table}"
    );
}

#[test]
fn a_rounded_prediction_is_right_in_the_exercise_and_in_the_grades() {
    let class = Class::new();
    for (number, prediction) in [("3", "10"), ("7a", "5.2"), ("7a", "5"), ("12", "20")] {
        let learner = format!("{number} {prediction}");
        let text = format!("{prediction} because it is about that");
        let said = predicts(&class, &learner, &[number, "--predict", &text]);
        assert!(said.contains(prediction), "{said}");
    }
    for row in rows(&class, &[]) {
        assert_eq!(row["right"], "true", "{row}");
    }
}

#[test]
fn a_csv_file_of_an_earlier_version_is_replaced() {
    let class = Class::new();
    class.predicts("anna", [8, 0], "half of the rate is still plenty");
    let csv = path(&class.0, "grades.csv");
    let old = "learner,accepted,item,right,number,unit,text,problem\nanna,true,x,,,,,\n";
    fs::write(&csv, old).expect("written");
    rows(&class, &[]);
    assert!(
        fs::read_to_string(&csv)
            .expect("read")
            .contains(",problem,copied_reason,")
    );
}

#[test]
fn a_bad_roster_is_refused_with_its_line() {
    let class = Class::new();
    class.predicts("anna", [8, 0], "half of the rate is still plenty");
    let roster = path(&class.0, "roster.csv");
    fs::write(&roster, "anna,17\nbert").expect("written");
    for (file, said) in [
        (&roster, "line 2: \"bert\""),
        (&path(&class.0, "none"), "none: "),
    ] {
        let told = complaint(&ratelab(&["grade", &class.dir(), "--roster", file]), 2);
        assert!(told.contains("--roster") && told.contains(said), "{told}");
    }
}
