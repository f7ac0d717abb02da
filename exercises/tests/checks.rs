//! Every promised measurement of an exercise lies in its band.

use std::{collections::HashSet, process, sync::OnceLock, sync::mpsc, thread, time::Duration};

use exercises::{
    framework::{Exercise, Findings, Prediction},
    parts, questions,
};

/// Many times the usual duration of an exercise: after it the exercise counts as blocked.
const FOR_EVER: Duration = Duration::from_secs(600);

/// Columns of a page of text in the lab, on a terminal of 80.
const PAGE: usize = 76;

/// The questions of an exercise, each with its findings.
type SharedFindings = Vec<(&'static Exercise, Findings)>;

/// Measures an exercise once for all tests. A blocked runtime would keep the test from
/// ending, so this ends the whole process.
fn findings(number: u32) -> &'static SharedFindings {
    static MEASURED: [OnceLock<SharedFindings>; 14] = [const { OnceLock::new() }; 14];
    MEASURED[number as usize - 1].get_or_init(|| {
        let measured = parts(number).map(|exercise| {
            let (sender, findings) = mpsc::channel();
            thread::spawn(move || drop(sender.send(exercise.run())));
            let findings = findings.recv_timeout(FOR_EVER).unwrap_or_else(|error| {
                eprintln!("exercise {number} does not end, or panicked: {error}");
                process::exit(1);
            });
            (exercise, findings.expect("measured"))
        });
        measured.collect()
    })
}

/// How many measurements of exercises 1 to 14 are promised.
const PROMISED: [usize; 14] = [71, 19, 36, 41, 40, 60, 78, 12, 12, 17, 3, 16, 22, 22];

#[test]
fn every_promised_measurement_lies_in_its_band() {
    let mut broken = Vec::new();
    for (number, promised) in (1..).zip(PROMISED) {
        let mut claims = Vec::new();
        for (exercise, findings) in findings(number) {
            claims.extend(findings.checks(exercise.brief()).expect("bands"));
        }
        let count = claims.len();
        assert!(count >= promised, "exercise {number}: {count} claims");
        let failed = claims.iter().filter(|check| !check.holds());
        broken.extend(failed.map(|check| format!("exercise {number}: {check}")));
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

#[test]
fn every_table_has_a_cell_for_each_of_its_headers_and_fits_on_a_page() {
    for (question, findings) in (1..=14).flat_map(findings) {
        let (brief, table) = (question.brief(), &findings.table);
        assert!(!table.rows.is_empty());
        let columns = table.headers.len();
        assert!(table.rows.iter().all(|row| row.len() == columns), "{table}");
        let middle = brief.choices.len().max(2) / 2;
        let prediction = Prediction::new(middle as f64, "of it").expect("finite");
        let text = findings.drawn(brief, &prediction);
        assert!(
            text.contains('◀') || text.contains('▶') || text.contains("you"),
            "{text}"
        );
        let mut lines = text.lines();
        assert!(lines.all(|line| line.chars().count() <= PAGE), "{text}");
    }
}

/// The predictions for a question that are just right, and those that are just wrong,
/// below and above; none where nothing is possible there.
type Edges = (&'static str, [f64; 2], [Option<f64>; 2]);

const EDGES: [Edges; 21] = [
    ("1", [7.0, 8.0], [Some(6.9), Some(8.1)]),
    ("2", [0.0, 0.0], [None, Some(1.0)]),
    ("3", [8.98, 10.98], [Some(8.9), Some(11.0)]),
    ("4", [11.0, 11.0], [Some(10.0), Some(12.0)]),
    ("5", [0.7, 0.8], [Some(0.69), Some(0.81)]),
    ("6a", [80.0, 90.0], [Some(79.0), Some(91.0)]),
    ("6b", [70.0, 80.0], [Some(69.0), Some(81.0)]),
    ("6c", [76.0, 96.0], [Some(75.0), Some(97.0)]),
    ("6d", [10.0, 24.0], [Some(9.0), Some(25.0)]),
    ("7a", [4.2, 6.27], [Some(4.1), Some(6.3)]),
    ("7b", [4.0, 4.0], [Some(3.0), Some(5.0)]),
    ("8a", [1.0, 5.0], [Some(0.0), Some(6.0)]),
    ("8b", [0.0, 0.0], [None, Some(1.0)]),
    ("9a", [0.0, 4.0], [None, Some(5.0)]),
    ("9b", [16.0, 20.0], [Some(15.0), None]),
    ("11", [4.0, 4.0], [Some(3.0), Some(5.0)]),
    ("12", [18.97, 20.95], [Some(18.9), Some(21.0)]),
    ("13a", [0.0, 2.0], [None, Some(3.0)]),
    ("13c", [1.5, 2.0], [Some(1.4), Some(2.1)]),
    ("14a", [18.0, 22.0], [Some(17.0), Some(23.0)]),
    ("14b", [38.0, 44.0], [Some(37.0), Some(45.0)]),
];

#[test]
fn a_prediction_is_right_within_the_tolerance_that_the_question_states() {
    let asked = questions()
        .map(|question| question.brief())
        .filter(|brief| brief.choices.is_empty());
    let asked: Vec<String> = asked.map(|brief| brief.label()).collect();
    assert_eq!(asked, EDGES.map(|(label, ..)| label));
    for (label, right, wrong) in EDGES {
        let brief = exercises::named(label)[0].brief();
        let mut all = findings(brief.number)
            .iter()
            .filter(|(question, _)| question.brief().name == brief.name);
        let (_, measured) = all.next().expect(label);
        let judged = |number: f64| {
            let prediction = Prediction::new(number, "of it").expect("finite");
            assert!(brief.range.contains(number), "{label}: {number}");
            let (hit, text) = measured.judge(brief, &prediction);
            assert_eq!(hit, text.starts_with("Correct"), "{label}: {text}");
            hit
        };
        for number in right {
            assert!(judged(number), "{label}: {number}");
        }
        for number in wrong.into_iter().flatten() {
            assert!(!judged(number), "{label}: {number}");
            let prediction = Prediction::new(number, "of it").expect("finite");
            let reply = measured.reply(brief, &prediction);
            assert!(
                !reply.is_empty() && reply != brief.replies.right,
                "{label}: {number}"
            );
        }
        assert!(
            brief.asked().contains("Counts as right: "),
            "{}",
            brief.asked()
        );
    }
}

/// Rows of a terminal, without the line of the prompt.
const ROWS: usize = 23;

#[test]
fn a_result_fits_on_a_terminal_of_80_by_24() {
    for (question, findings) in (1..=14).flat_map(findings) {
        let prediction =
            Prediction::new(5.0, "it takes as long as that, or so it seems to me").expect("finite");
        let text = findings.reconcile(question.brief(), &prediction);
        let lines = text.lines().map(|line| wrapped(line, 80)).sum::<usize>();
        // An empty line and the next step follow.
        let drawn = findings.drawn(question.brief(), &prediction);
        let rows = drawn.lines().count() + 1 + lines + 2;
        let label = question.brief().label();
        assert!(
            rows <= ROWS,
            "{label}: {rows} rows\n{}\n{text}",
            findings.table
        );
    }
}

/// Lines of a page in the lab on a terminal of 80x24, above the prediction.
const PAGE_LINES: usize = 12;

#[test]
fn a_question_is_in_sight_in_the_lab_at_80_by_24() {
    for brief in questions().map(|question| question.brief()) {
        let text = format!("{}\n\n{}", brief.objective, brief.asked());
        let lines = text.lines().map(|line| wrapped(line, PAGE)).sum::<usize>();
        assert!(lines <= PAGE_LINES, "{}: {lines} lines", brief.label());
    }
}

/// Lines of a paragraph that is wrapped between words to this many columns.
fn wrapped(paragraph: &str, columns: usize) -> usize {
    let mut lines = (1, 0);
    for word in paragraph.split(' ') {
        let wide = word.chars().count();
        lines = match lines {
            (rows, 0) => (rows, wide),
            (rows, used) if used + 1 + wide <= columns => (rows, used + 1 + wide),
            (rows, _) => (rows + 1, wide),
        };
    }
    lines.0
}

#[test]
fn the_worksheet_has_a_row_for_each_question() {
    let sheet = include_str!("../../docs/worksheet.md");
    let rows: Vec<&str> = sheet
        .lines()
        .filter_map(|line| line.strip_prefix("| "))
        .collect();
    for brief in questions().map(|question| question.brief()) {
        let label = format!("{} ", brief.label());
        let unit = match &*brief.unit {
            "" | "messages" => String::new(),
            unit => format!("({unit})"),
        };
        let mut rows = rows.iter().filter(|row| row.starts_with(&label));
        assert!(rows.any(|row| row.contains(&unit)), "{label}: {unit}");
    }
}

/// The mean latency at 25 Hz is 9.98 ms.
#[test]
fn the_first_table_does_not_answer_the_third_exercise() {
    let rows = findings(1)[0].1.table.rows.iter();
    let mut at_25 = rows.filter(|row| row[0] == "25 Hz");
    let row = at_25.next().expect("a row").join(" ");
    assert!(!row.contains("9.98") && !row.contains("10.0"), "{row}");
}

/// A hint and replies stand beside the question: they need no more than two lines each.
#[test]
fn every_question_has_a_hint_and_a_reply_to_each_prediction() {
    for brief in questions().map(|question| question.brief()) {
        let (label, replies) = (brief.label(), &brief.replies);
        assert!(!brief.hint.is_empty(), "{label}");
        assert!(wrapped(&brief.hint, PAGE) <= 4, "{label}: {}", brief.hint);
        assert!(!replies.right.is_empty(), "{label}");
        assert_eq!(
            replies.other.is_empty(),
            brief.choices.is_empty(),
            "{label}"
        );
        for reply in [
            &replies.right,
            &replies.above,
            &replies.below,
            &replies.other,
        ] {
            assert!(wrapped(reply, 80) <= 2, "{label}: {reply}");
        }
    }
}

/// The figures of the course, by `ratelab run --csv`: the widest angle before the policy is fast
/// again, and from then on.
#[test]
fn a_rescue_is_told_apart_from_a_pole_that_came_back_by_itself() {
    let (_, findings) = &findings(5)[0];
    let rows = findings.table.rows.iter();
    let told: Vec<String> = rows
        .map(|row| format!("{} {} {} {}", row[0], row[1], row[3], row[4]))
        .collect();
    assert_eq!(
        told[2..8],
        [
            "0.3 s 6.07° 5.82° rescued",
            "0.4 s 6.07° 4.91° back by itself",
            "0.5 s 6.07° 4.91° rescued",
            "0.6 s 6.07° 2.17° back by itself",
            "0.7 s 6.07° 1.07° back by itself",
            "0.8 s 7.68° 12.86° fell",
        ]
    );
    let meaning = &findings.meaning;
    let told = "After 0.4 s, 0.6 s and 0.7 s the pole was not in danger when the rate went up";
    assert!(meaning.contains(told), "{meaning}");
}

#[test]
fn exercises_are_numbered_as_listed_and_have_distinct_names() {
    let mut numbers: Vec<u32> = questions().map(|of| of.brief().number).collect();
    numbers.dedup();
    assert_eq!(numbers, Vec::from_iter(1..=14));
    let briefs: Vec<_> = questions().map(|exercise| exercise.brief()).collect();
    let names: HashSet<&str> = briefs.iter().map(|brief| &*brief.name).collect();
    let labels: HashSet<String> = briefs.iter().map(|brief| brief.label()).collect();
    assert_eq!((names.len(), labels.len()), (briefs.len(), briefs.len()));
    for brief in briefs {
        assert!(brief.question.ends_with('?'), "{}", brief.question);
    }
    assert!(exercises::find(0).is_none() && exercises::find(15).is_none());
}

#[test]
fn an_exercise_measures_the_same_every_time() {
    let bits = |findings: &Findings| -> Vec<u64> {
        let values = findings.measurements.iter();
        values.map(|measured| measured.value.to_bits()).collect()
    };
    // From the last, so that other tests measure the first ones meanwhile. Without the two whose
    // measurements take longer than those of all others.
    let quick = (1..=14).rev().filter(|number| ![6, 13].contains(number));
    for exercise in quick.filter_map(exercises::find) {
        let second = exercise.run().expect("measured");
        let (_, first) = &findings(exercise.brief().number)[0];
        assert_eq!(bits(first), bits(&second));
        assert_eq!(
            (&first.table, &first.meaning),
            (&second.table, &second.meaning)
        );
    }
}

#[test]
fn neighbours_with_different_numbers_have_different_faults_to_find() {
    let fault = exercises::find(10).expect("an exercise");
    let evidence = |seed| fault.evidence(seed).expect("a run").expect("a table");
    assert_eq!(evidence(3), evidence(3));
    assert_ne!(evidence(3), evidence(4));
    let answer = |seed| format!("{:?}", fault.measure(seed).expect("measured").answer);
    let answers: HashSet<String> = (0..12).map(answer).collect();
    assert!(answers.len() > 4, "{answers:?}");
}
