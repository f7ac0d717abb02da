//! Predictions, answers, bands and what is said about them.

use exercises::{
    ALL,
    practice::{
        Answer, Answers, Band, Bands, BandsError, Brief, Findings, Kind, Measurement, Prediction,
        Table,
    },
};

const BRIEF: Brief = Brief {
    number: 9,
    name: "nine",
    title: "Nine",
    kind: Kind::Investigation,
    objective: "Nothing.",
    question: "How many?",
    unit: "Hz",
};

fn predict(text: &str) -> Prediction {
    text.parse().expect(text)
}

#[test]
fn a_prediction_is_a_number_and_a_reason() {
    for (text, number, reason) in [
        ("8 because it is slow", 8.0, "it is slow"),
        ("8 Hz because it is slow", 8.0, "it is slow"),
        ("  7.5Hz, because it is slow. ", 7.5, "it is slow."),
        ("10: the pole needs a tenth", 10.0, "the pole needs a tenth"),
        ("-1 so it seems", -1.0, "so it seems"),
    ] {
        let prediction = predict(text);
        assert_eq!((prediction.number(), prediction.reason()), (number, reason));
        assert_eq!(predict(&prediction.to_string()), prediction);
    }
}

#[test]
fn a_prediction_without_number_or_reason_is_refused_with_an_example() {
    for (text, said) in [
        (
            "",
            "nothing is predicted yet: say a number and why, such as 8 because …",
        ),
        (
            "  ",
            "nothing is predicted yet: say a number and why, such as 8 because …",
        ),
        (
            "because",
            "\"because\" does not begin with a number: say one and why, such as 8 because …",
        ),
        (
            "8",
            "8 is a number without a reason: add one, such as 8 because …",
        ),
        (
            "8 because",
            "8 is a number without a reason: add one, such as 8 because …",
        ),
        (
            "8 ...",
            "8 is a number without a reason: add one, such as 8 because …",
        ),
    ] {
        let refused = text.parse::<Prediction>().expect_err(text);
        assert_eq!(refused.to_string(), said);
    }
    assert!(Prediction::new(f64::NAN, "it is none").is_err());
}

#[test]
fn answers_are_kept_in_their_file_until_they_are_forgotten() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("answers.toml");
    let mut answers = Answers::load(&path).expect("no file is no answers");
    assert!(
        ALL.iter()
            .all(|exercise| answers.get(exercise.brief()).is_none())
    );
    let odd = predict("8 because \"quotes\"\nand lines = [odd]");
    answers.set(&BRIEF, odd.clone());
    answers.set(ALL[0].brief(), predict("5.5 because of it"));
    answers.save(&path).expect("saved");
    let mut again = Answers::load(&path).expect("loaded");
    assert_eq!(again, answers);
    assert_eq!(again.get(&BRIEF), Some(&odd));
    again.clear(&BRIEF);
    again.save(&path).expect("saved over it");
    assert_eq!(Answers::load(&path).expect("loaded").get(&BRIEF), None);
    assert_eq!(folder.path().read_dir().expect("folder").count(), 1);
}

#[test]
fn a_file_that_holds_no_answers_is_refused_by_name_and_left_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("answers.toml");
    for text in [
        "nonsense",
        "[nine]\nnumber = 8.0\nreason = \"\"",
        "[nine]\nnumber = nan\nreason = \"it is none\"",
        "[nine]\nnumber = 8.0",
    ] {
        std::fs::write(&path, text).expect("written");
        let refused = Answers::load(&path).expect_err(text).to_string();
        assert!(refused.contains("answers.toml"), "{refused}");
        assert_eq!(std::fs::read_to_string(&path).expect("read"), text);
    }
    let new = folder.path().join("new/answers.toml");
    Answers::default().save(&new).expect("in a new folder");
    let nowhere = path.join("answers.toml");
    assert!(Answers::default().save(&nowhere).is_err());
}

fn band(text: &str) -> Result<Band, BandsError> {
    let text = format!("[sources]\nus = \"\"\n[exercises.nine]\nx = {{ {text} }}");
    let bands = Bands::parse(&text)?;
    Ok(bands.exercises["nine"]["x"].clone())
}

#[test]
fn a_band_holds_for_what_it_says_and_for_nothing_else() {
    for (text, inside, outside) in [
        ("equals = 501", vec![501.0], vec![500.999, f64::NAN]),
        (
            "reads = \"59.7206\"",
            vec![59.72055888, 59.72064],
            vec![59.7207, 59.7205],
        ),
        ("reads = \"-0.49\"", vec![-0.4902], vec![0.49, -0.48]),
        ("reads = \"3\"", vec![3.2], vec![3.6]),
        (
            "at_least = 1, at_most = 2",
            vec![1.0, 1.5, 2.0],
            vec![0.9, 2.1, f64::NAN],
        ),
        ("at_most = 2", vec![-9.0], vec![f64::NEG_INFINITY, 3.0]),
        ("equals = 3, reads = \"3.0\"", vec![3.0], vec![3.01]),
    ] {
        let band = band(&format!("{text}, source = \"us\"")).expect(text);
        assert!(inside.iter().all(|value| band.holds(*value)), "{text}");
        assert!(!outside.iter().any(|value| band.holds(*value)), "{text}");
    }
}

#[test]
fn a_band_without_bounds_or_source_is_refused() {
    let refused = |text| band(text).expect_err(text);
    assert!(matches!(
        refused("source = \"us\""),
        BandsError::Boundless(_)
    ));
    let unknown = refused("equals = 1, source = \"them\"");
    assert!(matches!(unknown, BandsError::UnknownSource { .. }));
    assert!(matches!(refused("equals = 1"), BandsError::Unreadable(_)));
    let misspelt = refused("equal = 1, source = \"us\"");
    assert!(matches!(misspelt, BandsError::Unreadable(_)));
}

#[test]
fn a_measurement_without_a_band_and_a_band_without_a_measurement_do_not_hold() {
    let text = "[sources]\nus = \"\"\n[exercises.nine]\n\
                known = { equals = 1, source = \"us\" }\n\
                forgotten = { equals = 1, source = \"us\" }";
    let bands = Bands::parse(text).expect("bands");
    let measured = [Measurement::new("known", 1.0), Measurement::new("new", 1.0)];
    let claims = bands.compare(&BRIEF, &measured).expect("claims");
    let holds: Vec<(&str, bool)> = claims.iter().map(|c| (&*c.name, c.holds())).collect();
    assert_eq!(
        holds,
        [("known", true), ("new", false), ("forgotten", false)]
    );
    let unknown = bands.compare(ALL[0].brief(), &measured);
    assert!(matches!(unknown, Err(BandsError::NoExercise(_))));
}

fn reconciled(answer: Answer, prediction: &str) -> String {
    let findings = Findings {
        table: Table::default(),
        answer,
        meaning: "So it is.".to_owned(),
        measurements: Vec::new(),
    };
    findings.reconcile(&BRIEF, &predict(prediction))
}

#[test]
fn a_prediction_is_put_beside_the_measurement() {
    assert_eq!(
        reconciled(Answer::Exactly(9.98004), "10 because it is half."),
        "You predicted 10 Hz, because it is half.\nMeasured: 9.98 Hz. Close: 0.02 Hz above it.\n\n\
         So it is."
    );
    let turn = Answer::Between {
        held: 10.0,
        failed: 5.0,
    };
    for (predicted, judged) in [
        ("5", "You called it."),
        ("8", "You called it."),
        ("10", "Just missed: at 10 Hz all was still well."),
        ("10.5", "Close: 0.5 Hz above it."),
        ("25", "You were 15 Hz above it."),
        ("1", "You were 4 Hz below it."),
    ] {
        let text = reconciled(turn, &format!("{predicted} because so"));
        assert!(text.contains("Measured: between 10 Hz and 5 Hz."), "{text}");
        assert!(text.contains(judged), "{text}");
    }
    let none = reconciled(Answer::Exactly(0.0), "2 because so");
    assert!(none.contains("You were 2 Hz above it."), "{none}");
}

#[test]
fn a_table_is_as_wide_as_its_widest_cells() {
    let mut table = Table::new(["a", "angle"]);
    table.row(["50 Hz".to_owned(), "1°".to_owned()]);
    assert_eq!(table.to_string(), "    a  angle\n50 Hz     1°\n");
}

#[test]
fn every_table_has_a_cell_for_each_of_its_headers() {
    for exercise in ALL {
        let table = exercise.run().expect("measured").table;
        assert!(!table.rows.is_empty());
        for row in &table.rows {
            assert_eq!(row.len(), table.headers.len());
        }
    }
}
