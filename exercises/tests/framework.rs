//! Predictions, answers, bands and their messages.

use std::{fs, path::PathBuf, sync::LazyLock};

#[path = "../../tests/support/table.rs"]
mod table;

use exercises::{
    framework::{
        Answer, Answers, Brief, Expectation, Expectations, ExpectationsError, Findings,
        Measurement, Prediction, PredictionOrigin, PredictionPlace, Range, Replies, Tolerance,
    },
    questions,
};
use ratelab_experiment::Table;
use table::rows;

static BRIEF: LazyLock<Brief> = LazyLock::new(|| Brief {
    number: 9,
    part: String::new(),
    name: "nine".to_owned(),
    title: "Nine".to_owned(),
    kind: "investigation".to_owned(),
    objective: "Nothing.".to_owned(),
    question: "How many?".to_owned(),
    quantity: "rate".to_owned(),
    unit: "Hz".to_owned(),
    tolerance: Tolerance::Within(0.5),
    range: Range {
        least: 0.0,
        most: 100.0,
        whole: false,
    },
    choices: Vec::new(),
    path: false,
    asks_limits: false,
    hint: String::new(),
    replies: Replies {
        right: "So it is.".to_owned(),
        above: "Too high.".to_owned(),
        below: "Too low.".to_owned(),
        other: "Not that.".to_owned(),
    },
});

/// A question with choices.
static CHOICE: LazyLock<Brief> = LazyLock::new(|| Brief {
    unit: String::new(),
    choices: ["policy slow", "policy", "/obs loses"]
        .map(str::to_owned)
        .to_vec(),
    ..BRIEF.clone()
});

fn predict(text: &str) -> Prediction {
    Prediction::read(text, &BRIEF).expect(text)
}

fn brief(number: u32) -> &'static Brief {
    exercises::find(number).expect("an exercise").brief()
}

/// The question in the first cell of a row: one of ours, or the number of an exercise.
fn asked(question: &str) -> &'static Brief {
    match question {
        "rate" => &BRIEF,
        "choice" => &CHOICE,
        number => brief(number.parse().expect("a number")),
    }
}

#[test]
fn a_prediction_is_a_number_or_a_choice_and_a_reason_in_any_words() {
    for [question, text, number, reason] in rows(
        "rate   | 8 because it is slow               | 8    | it is slow
         rate   | 8 Hz because it is slow            | 8    | it is slow
         rate   | 8 Hz: Because it is slow           | 8    | it is slow
         rate   | 7.5Hz, because it is slow.         | 7.5  | it is slow.
         rate   | 7,5 because it is slow             | 7.5  | it is slow
         rate   | 8, because it is slow              | 8    | it is slow
         rate   | 1e1 hertz so it seems              | 10   | so it seems
         rate   | 0.01 kHz so it seems               | 10   | so it seems
         rate   | 10: the pole needs a tenth         | 10   | the pole needs a tenth
         rate   | 8 weil es reicht                   | 8    | weil es reicht
         rate   | 8因为它很慢                        | 8    | 因为它很慢
         rate   | 8 because 80 ms at 20 ms a second  | 8    | 80 ms at 20 ms a second
         rate   | 0, 5 Hz is too slow                | 0    | 5 Hz is too slow
         rate   | +.5 for no reason                  | 0.5  | for no reason
         2      | 0 because of it                    | 0    | of it
         2      | 3 runs because of it               | 3    | of it
         2      | 3.0 because of it                  | 3    | of it
         5      | 0.7 because of it                  | 0.7  | of it
         5      | 0,7 s because of it                | 0.7  | of it
         5      | 700 ms because of it               | 0.7  | of it
         5      | 700ms because of it                | 0.7  | of it
         5      | 700000 µs because of it            | 0.7  | of it
         5      | 0.1 min because of it              | 6    | of it
         choice | policy slow because it is          | 1    | it is
         choice | Policy Slow: it decides twice      | 1    | it decides twice
         choice | policy because of it               | 2    | of it
         choice | /obs loses, look at the figures    | 3    | look at the figures",
    ) {
        let brief = asked(&question);
        for text in [text.clone(), format!("  {text} ")] {
            let read = Prediction::read(&text, brief).expect(&text);
            let found = (read.number().to_string(), read.reason().to_owned());
            assert_eq!(found, (number.clone(), reason.clone()), "{text}");
            if brief.choices.is_empty() {
                assert_eq!(Prediction::read(&read.to_string(), brief), Ok(read));
            }
        }
    }
    let read = Prediction::read("0.0299 s because of it", brief(3)).expect("read");
    assert!((read.number() - 29.9).abs() < 1e-9);
}

#[test]
fn another_prediction_is_refused_with_an_example() {
    let named = [
        (
            "RATE",
            "expected a number in Hz and a reason, as in N because …",
        ),
        (
            "CHOICE",
            "expected one of policy slow, policy, /obs loses and a reason, as in policy slow because …",
        ),
        (
            "SHORT",
            "is too short for a reason: say why in a few words, as in 8 Hz because …",
        ),
        ("BARE", "is without a reason: add one, as in"),
    ];
    // Texts for a question, and what is said to each, with it in place of the `*`.
    for [question, texts, said] in rows(
        r#"
        rate   |                                               | no prediction yet: RATE
        rate   | because; 5-10 so; 5 - 10 so; 5–10 Hz so       | "*": RATE
        rate   | 5 10 so; 8/10 so; 1.000,5 so; 5 Hz-10 Hz so   | "*": RATE
        rate   | 8 because; 8 ...; 8 Hz; 8 Hz, because         | 8 Hz BARE 8 Hz because …
        rate   | 8 because Hz; 8 because 8                     | 8 Hz BARE 8 Hz because …
        rate   | 8 because x                                   | "x" SHORT
        rate   | 8 because so                                  | "so" SHORT
        rate   | 8 because physics                             | "physics" SHORT
        rate   | 8 because x y                                 | "x y" SHORT
        rate   | 8 because x x                                 | "x x" SHORT
        rate   | 8 because no no no                            | "no no no" SHORT
        rate   | 8 because ß                                   | "ß" SHORT
        1      | 8 s because of it                             | "s" is not a unit here: expected a number in Hz
        1      | 8kg because of it                             | "kg" is not a unit here: expected a number in Hz
        1      | 8x because of it                              | "x" is not a unit here: expected a number in Hz
        2      | 2 Hz because of it                            | "Hz" is not a unit here: expected a number
        5      | 5 % because of it                             | "%" is not a unit here: expected a number in s
        1      | 1e400; 1e400 because of it                    | inf Hz is impossible here: expected 0 to 50 Hz
        1      | -1 because of it                              | -1 Hz is impossible here: expected 0 to 50 Hz
        2      | -1 because of it                              | -1 is impossible here: expected a whole number, 0 to 3
        2      | 10 because of it                              | 10 is impossible here: expected a whole number, 0 to 3
        2      | 1.5 because of it                             | 1.5 is impossible here: expected a whole number, 0 to 3
        4      | 4 because of it                               | 4 Hz is impossible here: expected a whole number, 5 to 12 Hz
        5      | 700 because of it                             | 700 s is impossible here: expected 0 to 10 s
        choice | 1 because of it; policyslow because of it     | "*": CHOICE
        choice | sensor; ∆; /obs losesX so                     | "*": CHOICE
        choice | policy slow                                   | policy slow BARE policy slow because …
        choice | /obs loses because                            | /obs loses BARE /obs loses because …
        "#,
    ) {
        for text in texts.split("; ") {
            let said = named
                .iter()
                .fold(said.replace('*', text), |said, (name, all)| {
                    said.replace(name, all)
                });
            for text in [text.to_owned(), format!("  {text} ")] {
                let refused = Prediction::read(&text, asked(&question)).expect_err(&text);
                assert_eq!(refused.to_string(), said, "{text}");
            }
        }
    }
    assert!(Prediction::new(f64::NAN, "it is none").is_err());
}

#[test]
fn every_exercise_reads_a_number_in_its_own_unit() {
    let numeric = questions().filter(|exercise| exercise.brief().choices.is_empty());
    for exercise in numeric {
        let brief = exercise.brief();
        for number in [brief.range.least, brief.range.most] {
            let text = format!("{number} {} because of it", brief.unit);
            let read = Prediction::read(&text, brief).expect(&text);
            assert_eq!(read.number(), number);
        }
    }
}

/// A file of answers.
struct Kept(tempfile::TempDir);

impl Kept {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a folder"))
    }

    fn path(&self) -> PathBuf {
        self.0.path().join("answers.toml")
    }

    fn write(&self, text: &str) {
        fs::write(self.path(), text).expect("written");
    }

    fn read(&self) -> String {
        fs::read_to_string(self.path()).expect("read")
    }

    /// The answers in the file, after `answers` were saved to it.
    fn again(&self, answers: &Answers) -> Answers {
        let saved = Answers::change(&self.path(), |known| *known = answers.clone());
        assert_eq!(&saved.expect("saved"), answers);
        self.load()
    }

    fn load(&self) -> Answers {
        Answers::load(&self.path()).expect("loaded")
    }
}

/// An answer that somebody wrote into the file.
const BY_HAND: &str = "[nine]\nnumber = 8.0\nreason = \"so\"";

#[test]
fn answers_are_kept_in_their_file_until_they_are_asked_for_again() {
    let kept = Kept::new();
    let mut answers = kept.load();
    let none = questions().all(|exercise| answers.get(exercise.brief()).is_none());
    assert!(none, "no file is no answers");
    let odd = predict("8 because \"quotes\"\nand lines = [odd]").about(17);
    answers.set(&BRIEF, odd.clone());
    answers.set(brief(1), predict("5.5 because of it"));
    let mut again = kept.again(&answers);
    assert_eq!(again, answers);
    assert_eq!(again.get(&BRIEF), Some(&odd));
    assert_eq!(odd.seed(), 17, "the number of the learner");
    again.reopen(&BRIEF);
    assert_eq!(kept.again(&again).get(&BRIEF), None);
    assert_eq!(kept.0.path().read_dir().expect("folder").count(), 1);
    // A file of an earlier version has no number of a learner.
    kept.write(BY_HAND);
    assert_eq!(kept.load().get(&BRIEF).map(Prediction::seed), Some(0));
}

#[test]
fn an_invalid_file_of_answers_is_refused_by_name_and_kept() {
    let kept = Kept::new();
    for text in [
        "nonsense",
        "[nine]\nnumber = 8.0\nreason = \"\"",
        "[nine]\nnumber = nan\nreason = \"it is none\"",
        "[nine]\nnumber = 8.0",
        "[nine]\nnumber = 8.0\nreason = \"so\"\nseed = -1",
        "[nine]\nnumber = 8.0\nreason = \"so\"\nseed = 1.5",
        "[nine]\nnumber = 8.0\nreason = \"so\"\nseed = \"x\"",
    ] {
        kept.write(text);
        let refused = Answers::load(&kept.path()).expect_err(text).to_string();
        assert!(refused.contains("answers.toml"), "{refused}");
        assert_eq!(kept.read(), text);
    }
    let new = kept.0.path().join("new/answers.toml");
    Answers::change(&new, |_| ()).expect("in a new folder");
    let nowhere = kept.path().join("answers.toml");
    assert!(Answers::change(&nowhere, |_| ()).is_err());
}

fn band(text: &str) -> Result<Expectation, ExpectationsError> {
    let text = format!("[sources]\nus = \"\"\n[exercises.nine]\nx = {{ {text} }}");
    let bands = Expectations::parse(&text)?;
    Ok(bands.exercises["nine"]["x"].clone())
}

#[test]
fn a_band_holds_for_its_values_only() {
    for [text, inside, outside] in rows(
        r#"
        equals = 501                 | 501                  | 500.999 NaN
        reads = "59.7206"            | 59.72055888 59.72064 | 59.7207 59.7205
        reads = "-0.49"              | -0.4902              | 0.49 -0.48
        reads = "3"                  | 3.2                  | 3.6
        at_least = 1, at_most = 2    | 1 1.5 2              | 0.9 2.1 NaN
        at_most = 2                  | -9                   | -inf 3
        equals = 3, reads = "3.0"    | 3                    | 3.01
        "#,
    ) {
        let band = band(&format!("{text}, source = \"us\"")).expect(&text);
        for (values, holds) in [(inside, true), (outside, false)] {
            let mut values = values
                .split(' ')
                .map(|value| value.parse().expect("a number"));
            assert!(values.all(|value| band.holds(value) == holds), "{text}");
        }
    }
}

#[test]
fn a_band_without_bounds_or_source_is_refused() {
    for (text, why) in [
        ("source = \"us\"", "the band of \"x\" holds for every value"),
        (
            "equals = 1, source = \"them\"",
            "the band of \"x\" comes from \"them\"",
        ),
        ("equals = 1", "bands.toml cannot be read"),
        ("equal = 1, source = \"us\"", "bands.toml cannot be read"),
    ] {
        let refused = band(text).expect_err(text).to_string();
        assert!(refused.starts_with(why), "{text}: {refused}");
    }
}

#[test]
fn a_measurement_without_a_band_and_a_band_without_a_measurement_do_not_hold() {
    let text = "[sources]\nus = \"\"\n[exercises.nine]\n\
                known = { equals = 1, source = \"us\" }\n\
                forgotten = { equals = 1, source = \"us\" }";
    let bands = Expectations::parse(text).expect("bands");
    let measured = [Measurement::new("known", 1.0), Measurement::new("new", 1.0)];
    let checks = bands.compare(&BRIEF, &measured).expect("claims");
    let holds: Vec<(&str, bool)> = checks.iter().map(|c| (&*c.name, c.holds())).collect();
    assert_eq!(
        holds,
        [("known", true), ("new", false), ("forgotten", false)]
    );
    let unknown = bands.compare(brief(1), &measured).expect_err("unknown");
    assert!(
        unknown
            .to_string()
            .starts_with("exercise \"cliff\" has no bands")
    );
}

fn findings(answer: Answer) -> Findings {
    Findings {
        table: Table::default(),
        place: PredictionPlace::Between,
        answer,
        meaning: "It means something.".to_owned(),
        measurements: Vec::new(),
    }
}

fn reconciled(answer: Answer, prediction: &str) -> String {
    findings(answer).reconcile(&BRIEF, &predict(prediction))
}

#[test]
fn a_prediction_is_compared_with_the_measurement() {
    assert_eq!(
        reconciled(Answer::Exactly(9.98004), "10 because it is half."),
        "You predicted 10 Hz: it is half.\nMeasured: 9.98 Hz. Correct to within 0.02 Hz.\n\
         So it is.\n\nIt means something."
    );
    let turn = Answer::Between {
        from: 10.0,
        to: 5.0,
    };
    for [predicted, judged] in rows(
        r"5    | Correct.\nSo it is.
         8    | Correct.\nSo it is.
         10   | Correct.\nSo it is.
         10.5 | Correct to within 0.5 Hz.\nSo it is.
         4.5  | Correct to within 0.5 Hz.\nSo it is.
         10.6 | Close: 0.6 Hz above it.\nToo high.
         25   | You were 15 Hz above it.\nToo high.
         1    | You were 4 Hz below it.\nToo low.",
    ) {
        let text = reconciled(turn.clone(), &format!("{predicted} because of it"));
        assert!(text.contains("Measured: between 10 Hz and 5 Hz."), "{text}");
        assert!(text.contains(&judged.replace(r"\n", "\n")), "{text}");
        let prediction = predict(&format!("{predicted} because of it"));
        let (hit, _) = findings(turn.clone()).judge(&BRIEF, &prediction);
        assert_eq!(hit, judged.starts_with("Correct"), "{predicted}");
    }
    assert_eq!(brief(11).in_unit(1.0), "1 message");
    let zero = reconciled(Answer::Exactly(0.0), "2 because of it");
    assert!(zero.contains("You were 2 Hz above it."), "{zero}");
}

#[test]
fn a_table_is_as_wide_as_its_widest_cells() {
    let table = Table::from_items(
        &["50 Hz"],
        &[
            ("a", &|hz| (*hz).to_owned()),
            ("angle", &|_| "1°".to_owned()),
        ],
    );
    assert_eq!(table.to_string(), "    a  angle\n50 Hz     1°\n");
}

#[test]
fn a_wrong_choice_is_answered_with_what_refutes_it() {
    let findings = findings(Answer::Choice {
        number: 3.0,
        refuted: ["one", "two", "three"].map(str::to_owned).to_vec(),
    });
    let judged = |text| {
        let prediction = Prediction::read(text, &CHOICE).expect(text);
        findings.judge(&CHOICE, &prediction)
    };
    assert_eq!(judged("policy because of it"), (false, "two".to_owned()));
    assert_eq!(judged("/obs loses as seen"), (true, "Correct.".to_owned()));
    let prediction = Prediction::read("policy slow as seen", &CHOICE).expect("a choice");
    let text = findings.reconcile(&CHOICE, &prediction);
    assert!(
        text.contains("You predicted policy slow: as seen."),
        "{text}"
    );
    assert!(text.contains("Measured: /obs loses."), "{text}");
    assert!(text.contains("\nNot that."), "{text}");
}

#[test]
fn a_prediction_is_drawn_into_the_table() {
    let rates = ["50 Hz", "10 Hz", "5 Hz"];
    let table = Table::from_items(
        &rates,
        &[
            ("rate", &|hz| (*hz).to_owned()),
            ("up", &|_| "3".to_owned()),
        ],
    );
    let drawn = |place, number| {
        let findings = Findings {
            table: table.clone(),
            place,
            ..findings(Answer::Exactly(8.0))
        };
        findings.drawn(&BRIEF, &predict(&format!("{number} because of it")))
    };
    let all = " rate  up\n50 Hz   3\n10 Hz   3\n 5 Hz   3\n";
    for (place, number, from, to) in [
        (
            PredictionPlace::Between,
            10.0,
            "10 Hz   3",
            "10 Hz   3  ◀ you",
        ),
        (
            PredictionPlace::Between,
            15.0,
            "10 Hz",
            "15 Hz  ◀ you\n10 Hz",
        ),
        (
            PredictionPlace::Between,
            60.0,
            "50 Hz",
            "60 Hz  ◀ you\n50 Hz",
        ),
        (
            PredictionPlace::Between,
            1.0,
            "5 Hz   3\n",
            "5 Hz   3\n 1 Hz  ◀ you\n",
        ),
        (
            PredictionPlace::Row(1),
            7.0,
            "10 Hz   3",
            "10 Hz   3  ◀ you: 7 Hz",
        ),
        (PredictionPlace::Choice, 3.0, "5 Hz   3", "5 Hz   3  ◀ you"),
    ] {
        assert_eq!(drawn(place, number), all.replace(from, to), "{number}");
    }
    let column = drawn(PredictionPlace::Column(1), 7.0);
    assert!(column.ends_with("\n  you  7 Hz\n"), "{column}");
    let below = drawn(PredictionPlace::Below, 7.0);
    assert!(below.ends_with("\nrate 7 Hz  ◀ you\n"), "{below}");
    let cell = drawn(PredictionPlace::Cell, 10.0);
    assert!(cell.contains("▶ 10 Hz"), "{cell}");
}

#[test]
fn whether_the_first_prediction_was_right_is_kept_and_told() {
    let kept = Kept::new();
    let mut answers = kept.load();
    answers.set(&BRIEF, predict("8 because of it"));
    let told = |answers: &Answers| answers.predicted(&BRIEF).expect("a prediction");
    assert_eq!(told(&answers), "you predicted 8 Hz");
    let measured = findings(Answer::Exactly(12.0));
    let judge = |answers: &mut Answers, exercise: &Brief, seed: u64| {
        let judged = answers.judge(&kept.path(), exercise, &measured, seed);
        judged.expect("noted");
    };
    let mut answers = kept.again(&answers);
    // Another program predicts meanwhile.
    let other = Prediction::new(1.0, "as seen").expect("finite").about(3);
    let saved = Answers::change(&kept.path(), |known| known.set(brief(10), other));
    saved.expect("saved");
    judge(&mut answers, &BRIEF, 0);
    assert_eq!(told(&answers), "✖ you predicted 8 Hz");
    assert!(answers.get(brief(10)).is_some(), "what is in the file");
    assert_eq!(kept.load(), answers);
    assert!(matches!(
        answers.origin(&BRIEF),
        Some(PredictionOrigin::Written(_))
    ));
    // What is known is not written again, and what was measured for another number says nothing.
    fs::remove_file(kept.path()).expect("removed");
    judge(&mut answers, &BRIEF, 0);
    judge(&mut answers, brief(10), 4);
    assert!(!kept.path().exists());
    // What is predicted again counts no more.
    answers.set(&BRIEF, predict("12 because I have seen it"));
    let mut again = kept.again(&answers);
    judge(&mut again, &BRIEF, 0);
    assert_eq!(told(&again), "✖ you predicted 12 Hz, first 8 Hz");
}

#[test]
fn the_next_question_is_the_first_open_one_of_the_path() {
    let mut answers = Answers::default();
    let mut order = Vec::new();
    while let Some(next) = exercises::next(&answers) {
        order.push(next.brief().label());
        let prediction = Prediction::new(1.0, "of it").expect("finite");
        answers.set(next.brief(), prediction);
    }
    let order = order.join(" ");
    assert!(
        order.starts_with("1 2 5 6a 6b 6c 6d 7a 7b 10 3 4 8a "),
        "{order}"
    );
    assert_eq!(order.split(' ').count(), questions().len());
}

#[test]
fn the_limits_are_found_once_all_questions_about_them_have_a_prediction() {
    let mut answers = Answers::default();
    let asked = ["6a", "6b", "6c", "6d", "7b"];
    for label in asked {
        assert!(!exercises::has_found_limits(&answers), "{label}");
        let prediction = Prediction::new(1.0, "of it").expect("finite");
        answers.set(exercises::named(label)[0].brief(), prediction);
    }
    assert!(exercises::has_found_limits(&answers));
}

#[test]
fn the_first_prediction_is_kept_when_it_is_made_again() {
    let kept = Kept::new();
    let mut answers = Answers::default();
    for text in ["8 because of it", "7 because I saw it", "6 because I know"] {
        answers.reopen(&BRIEF);
        assert_eq!(answers.get(&BRIEF), None);
        answers.set(&BRIEF, predict(text));
        answers = kept.again(&answers);
        let numbers = [answers.first(&BRIEF), answers.get(&BRIEF)]
            .map(|known| known.map(|known| known.number()));
        assert_eq!(numbers, [Some(8.0), Some(predict(text).number())]);
    }
    assert_eq!(answers.redone(&BRIEF), Some(&predict("6 because I know")));
    // What is asked for again is still kept when nobody answers.
    answers.reopen(&BRIEF);
    let left = kept.again(&answers);
    assert_eq!(left.get(&BRIEF), None);
    assert_eq!(left.first(&BRIEF), Some(&predict("8 because of it")));
}

#[test]
fn what_was_changed_in_the_file_is_told_from_what_was_written() {
    let kept = Kept::new();
    let mut answers = Answers::default();
    answers.set(&BRIEF, predict("8 because of it").about(3));
    answers.set(&BRIEF, predict("7 because I saw it").about(3));
    let mark = kept.again(&answers).origin(&BRIEF).expect("an entry");
    assert!(matches!(mark, PredictionOrigin::Written(_)), "{mark:?}");
    let written = kept.read();
    let origin = |text: &str| {
        kept.write(text);
        kept.load().origin(&BRIEF).expect("an entry")
    };
    for (from, to) in [
        ("number = 7", "number = 5"),
        ("number = 8", "number = 5"),
        ("I saw it", "I saw that"),
        ("of it", "of that"),
        ("seed = 3", "seed = 4"),
        ("[nine.first]", "[ten]"),
    ] {
        assert!(written.contains(from), "{written}");
        let edited = written.replacen(from, to, 1);
        assert_eq!(origin(&edited), PredictionOrigin::Edited, "{from}");
    }
    assert_eq!(origin(BY_HAND), PredictionOrigin::Unmarked);
    // Two predictions with the same words have marks of their own.
    let mut others = Answers::default();
    others.set(&BRIEF, predict("8 because of it").about(3));
    assert_ne!(others.origin(&BRIEF), Some(mark));
}
