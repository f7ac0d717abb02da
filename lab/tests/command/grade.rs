//! `ratelab grade`: the hand-ins of a class.

use std::fs;

use serde_json::Value;

use crate::support::{Folder, Said};

/// A rescue by hand: the run times at which the policy was slowed and made fast again (s).
fn knobs(slowed: f64, fast: f64) -> String {
    format!("{slowed:.9} control-hz 5\n{fast:.9} control-hz 25\n")
}

/// A class with a folder per learner, in `class`.
struct Class(Folder);

impl Class {
    fn new() -> Self {
        let folder = Folder::new();
        fs::create_dir(folder.path("class")).expect("made");
        Self(folder)
    }

    /// Writes a file of a learner.
    fn hands_in(&self, learner: &str, file: &str, content: impl AsRef<[u8]>) {
        self.0.write(&format!("class/{learner}/{file}"), content);
    }

    /// Predictions for the first two exercises.
    fn predicts(&self, learner: &str, [rate, saved]: [u32; 2], reason: &str) {
        let answers = format!(
            "[cliff]\nnumber = {rate}\nreason = \"{reason}\"\n\
             [deeper-queue]\nnumber = {saved}\nreason = \"{reason}\"\n"
        );
        self.hands_in(learner, "answers.toml", answers);
    }

    /// Does an exercise as a learner does; what is said.
    fn does(&self, learner: &str, options: &str) -> Said {
        fs::create_dir_all(self.0.path("class").join(learner)).expect("made");
        let answers = format!("--answers 'class/{learner}/answers.toml'");
        self.0.says(&format!("exercise {answers} {options}"))
    }

    /// Records a rescue with these knobs.
    fn rescues(&self, learner: &str, knobs: &str) {
        self.0.write("knobs", knobs);
        let file = format!("class/{learner}/rescue.rrd");
        let run = "run --clock virtual --knobs knobs --record";
        self.0.says(&format!("{run} {file}"));
    }

    /// The table of the grades, where all are acceptable.
    fn grades(&self, options: &str) -> Said {
        self.0.says(&format!("grade class {options}"))
    }
}

#[test]
fn thirty_hand_ins_are_graded_in_one_command_and_two_copies_are_found() {
    let class = Class::new();
    for number in 0..30 {
        let reason = format!("learner {number} says so");
        let learner = format!("learner-{number:02}");
        class.predicts(&learner, [number, number % 4], &reason);
    }
    for number in 0..6 {
        // No two hands are at it for as long.
        let late = f64::from(number + 1);
        let knobs = knobs(0.995_434_574 + 13e-3 * late, 2.116_662_647 + 7e-3 * late);
        class.rescues(&format!("learner-{number:02}"), &knobs);
    }
    // One copies the file, one records the commands of another again, almost at the same
    // nanoseconds, and one a little later.
    let original = class.0.bytes("class/learner-02/rescue.rrd");
    class.hands_in("learner-20", "mine.rrd", original);
    let of_another = [0.995_434_574 + 52e-3, 2.116_662_647 + 28e-3];
    for (learner, later) in [("learner-21", 4e-9), ("learner-22", 5e-3)] {
        let [slowed, fast] = of_another.map(|at| at + later);
        class.rescues(learner, &knobs(slowed, fast));
    }

    // Nobody knows who copied from whom: both are named, and nobody is refused.
    let table = class.grades("--csv grades.csv");
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
        table.has(line);
    }
    assert_eq!(table.matches("the same session as").count(), 5, "{table:?}");
    let rows = Said(class.0.read("grades.csv"));
    assert_eq!(rows.lines().count(), 1 + 2 * 30 + 9, "{rows:?}");
    rows.has("learner-07,true,exercise 1,true,7,Hz,learner 7 says so,,,without a mark");

    let graded = class.0.json("grade class --json");
    let hand_ins = graded["hand_ins"].as_array().expect("a list");
    let accepted = hand_ins.iter().filter(|known| known["accepted"] == true);
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
    class.0.plays(
        "cd class && mkdir dora emil fred gina hans
         cp $CLONE/recordings/rescued.rrd class/emil/own.rrd
         cp $CLONE/recordings/balanced-50hz.rrd class/fred/own.rrd
         cp $CLONE/recordings/fall-5hz.rrd class/gina/own.rrd
         head -c \"$(($(wc -c < class/emil/own.rrd) / 2))\" class/emil/own.rrd > class/hans/cut.rrd",
    );
    class.hands_in("ida", "own.rrd", "no recording");
    let answers = "[cliff]\nnumber = 8\nreason = \"\u{9b}2J so\"";
    class.hands_in("\u{1b}[31mjo", "answers.toml", answers);
    let (told, table) = class.0.fails("grade class", 1);
    assert_eq!(&*told, "error: 7 of 10 hand-ins are not acceptable\n");
    table
        .has("✖ bert: 20 Hz, Half of the rate is still plenty! (the words of anna)")
        .has("✖ carl: answers.toml: line 1: ")
        .has("✖ dora: nothing is handed in")
        .has("✖ emil/own.rrd: comes with ratelab")
        .has("✖ fred/own.rrd: no rescue: ")
        .has("✖ gina/own.rrd: no rescue: ")
        .has("✖ hans/cut.rrd: nothing in this recording is whole: it ends")
        .has("✖ ida/own.rrd: this is not a rerun recording")
        .lacks("\u{1b}")
        .lacks("\u{9b}");
}

#[test]
fn questions_drawn_from_a_number_are_graded_with_that_number() {
    let mut questions = exercises::questions();
    let drawn = questions.find(|question| question.draws() && !question.brief().choices.is_empty());
    let brief = drawn.expect("a question with choices").brief();
    let name = &brief.name;
    let class = Class::new();
    for seed in [1, 2] {
        for (number, _) in (1..).zip(&brief.choices) {
            let reason = "reason = \"it looked like it\"";
            let answer = format!("[{name}]\nnumber = {number}\n{reason}\nseed = {seed}\n");
            class.hands_in(&format!("seat-{seed}-{number:02}"), "answers.toml", answer);
        }
    }
    let graded = class.0.json("grade class --json");
    for seed in [1, 2] {
        let hand_ins = graded["hand_ins"].as_array().expect("a list").iter();
        let marks = hand_ins.map(|hand_in| &hand_in["predictions"][0]);
        let right = marks.filter(|mark| mark["seed"] == seed && mark["right"] == true);
        assert_eq!(right.count(), 1, "number {seed}");
    }
    let table = class.grades("");
    table.has("drawn from the learner's number");
}

/// The rows of the CSV file, by column.
fn rows(class: &Class, options: &str) -> Vec<Value> {
    class.grades(&format!("--csv grades.csv {options}"));
    let text = class.0.read("grades.csv");
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

/// A learner, the options of what they did, and for exercise 1 whether they are right; then
/// what is flagged, with a part of the evidence.
type Hiding<'a> = (&'a str, &'a str, &'a str, &'a str);

#[rustfmt::skip]
const PLAYED: [Hiding<'_>; 10] = [
    ("s1", "1 --predict '7.5 because the pole is slow'", "true", "copied_reason: the words of s12"),
    ("s2", "1 --predict '20 because it is fast'", "false", "copied_reason: the entry of s10"),
    ("s10", "", "false", "copied_reason: the entry of s2"),
    ("s11", "", "true", "edited: changed after ratelab wrote it"),
    ("s12", "1 --predict '9 because the pole is slow'", "false", "copied_reason: the words of s1"),
    ("s13", "1 --predict '30 because nobody knows it'", "false", "redone: later 7.5 Hz"),
    ("s14", "", "true", "edited: without a mark\nno_reason: is not a reason"),
    ("s15", "1 --predict '40 because of the sensor'", "false", ""),
    ("s16", "10 --predict 'policy slow because it looks so' --seed 3", "", ""),
    ("s17", "10 --predict 'policy slow because I guess so' --seed 3", "",
        "foreign_seed: about number 3 of s16; the roster has 4"),
];

/// The class of [`PLAYED`], with its roster.
fn a_class_with_secrets() -> Class {
    let class = Class::new();
    for (learner, did, ..) in PLAYED.iter().filter(|(_, did, ..)| !did.is_empty()) {
        class.does(learner, did);
    }
    class.does("s13", "1 --redo --predict '7.5 because I saw it'");
    let original = class.0.read("class/s2/answers.toml");
    class.hands_in("s10", "answers.toml", &original);
    class.hands_in("s11", "answers.toml", original.replace("20.0", "7.5"));
    let by_hand = "[cliff]\nnumber = 7.5\nreason = \"x\"";
    class.hands_in("s14", "answers.toml", by_hand);
    let roster = "name,number\ns16,3\ns17,4\ns18,5\n";
    class.0.write("roster.csv", roster);
    class
}

#[test]
fn what_a_prediction_hides_is_flagged_with_its_evidence_and_the_first_one_counts() {
    let rows = rows(&a_class_with_secrets(), "--roster roster.csv");
    assert_eq!(rows.len(), PLAYED.len());
    // In the order of people.
    for (row, (learner, _, right, flags)) in rows.iter().zip(PLAYED) {
        assert_eq!(row["learner"], learner);
        assert!(right.is_empty() || row["right"] == right, "{row}");
        for flag in "copied_reason edited foreign_seed redone no_reason".split(' ') {
            let said = row[flag].as_str().expect("a column");
            let mut flags = flags.lines().filter_map(|flag| flag.split_once(": "));
            match flags.find(|(name, _)| *name == flag) {
                Some((_, why)) => assert!(said.contains(why), "{learner} {flag}: {said}"),
                None => assert_eq!(said, "", "{learner} {flag}"),
            }
        }
    }
}

#[test]
fn the_table_counts_each_question_and_lists_what_to_look_at() {
    let class = a_class_with_secrets();
    let table = class.grades("--roster roster.csv");
    table
        .has("hand-ins  10, 10 acceptable, 8 to look at")
        .has("roster    3, without a hand-in: s18")
        .has("learner  1 control rate Hz  10 culprit")
        .has("  3 of 8 right")
        .has("  ? s11 1: changed after ratelab wrote it")
        .has("  ? s17 10: about number 3 of s16; the roster has 4");
    let mut lines = table.lines();
    assert!(lines.all(|line| line.chars().count() <= 80), "{table:?}");
    // Without a roster it is said that nobody looked.
    let table = class.grades("");
    table.has("numbers   as each hand-in has it, unchecked");
}
