//! Every promised measurement of an exercise lies in its band.

use std::{collections::HashSet, process, sync::mpsc, thread, time::Duration};

use exercises::{ALL, framework::Check};

/// A hundred times the usual duration of a run: after it the run counts as blocked.
const FOR_EVER: Duration = Duration::from_secs(60);

/// Checks an exercise. A blocked runtime would keep the test from ending, so this ends
/// the whole process.
fn check(number: u32) {
    let exercise = exercises::find(number).expect("an exercise");
    let (sender, claims) = mpsc::channel();
    thread::spawn(move || sender.send(exercise.check()));
    let claims = claims.recv_timeout(FOR_EVER).unwrap_or_else(|error| {
        eprintln!("exercise {number} does not end, or panicked: {error}");
        process::exit(1);
    });
    let claims = claims.expect("measured");
    assert!(claims.len() >= 19, "only {} claims", claims.len());
    let broken: Vec<&Check> = claims.iter().filter(|check| !check.holds()).collect();
    let said: Vec<String> = broken.iter().map(ToString::to_string).collect();
    assert!(broken.is_empty(), "{}", said.join("\n"));
}

#[test]
fn exercise_1_the_control_rate_cliff() {
    check(1);
}

#[test]
fn exercise_2_a_deeper_queue() {
    check(2);
}

#[test]
fn exercise_3_when_two_clocks_tie() {
    check(3);
}

#[test]
fn exercise_4_where_the_theory_stops() {
    check(4);
}

#[test]
fn exercise_5_rescue_it() {
    check(5);
}

#[test]
fn exercises_are_numbered_as_listed_and_have_distinct_names() {
    let briefs: Vec<_> = ALL.iter().map(|exercise| exercise.brief()).collect();
    let numbers: Vec<u32> = briefs.iter().map(|brief| brief.number).collect();
    assert_eq!(numbers, [1, 2, 3, 4, 5]);
    let names: HashSet<&str> = briefs.iter().map(|brief| brief.name).collect();
    assert_eq!(names.len(), ALL.len());
    for brief in briefs {
        assert!(brief.question.ends_with('?'), "{}", brief.question);
    }
    assert!(exercises::find(0).is_none() && exercises::find(6).is_none());
}

#[test]
fn an_exercise_measures_the_same_every_time() {
    for exercise in ALL {
        let findings = || exercise.run().expect("measured");
        let (first, second) = (findings(), findings());
        let bits = |findings: &exercises::framework::Findings| -> Vec<u64> {
            let values = findings.measurements.iter();
            values.map(|measured| measured.value.to_bits()).collect()
        };
        assert_eq!(bits(&first), bits(&second));
        assert_eq!((first.table, first.meaning), (second.table, second.meaning));
    }
}
