//! Exercises on the rate of a control loop: predict, run, check.
//!
//! Each exercise states its objective and asks for one number. After the prediction it
//! runs on the virtual clock, in the ordinary graph, and compares the prediction with the
//! measurement. All printed results are measured in the same run of the program. The
//! expected measurements are in `bands.toml`, each with its source.
//!
//! ```
//! use exercises::{ALL, framework::Prediction};
//!
//! let exercise = exercises::find(2).expect("there is a second one");
//! println!("{}\n\n{}", exercise.brief().objective, exercise.brief().question);
//! let prediction = Prediction::read("2 because nothing is lost any more", exercise.brief())?;
//! let findings = exercise.run()?;
//! println!("{}\n{}", findings.table, findings.reconcile(exercise.brief(), &prediction));
//! assert!(exercise.check()?.iter().all(|check| check.holds()));
//! assert_eq!(ALL.len(), 12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Each exercise is a module of this crate; [`framework`] is their common part. They stand on the
//! cart-pole, and print nothing: the command asks and prints. A new exercise is a module with a
//! row in [`ALL`], and its figures in `bands.toml`.

pub mod build;
pub mod cliff;
pub mod deep_queue;
pub mod deeper_queue;
pub mod fault;
pub mod framework;
pub mod hold_or_zero;
pub mod jitter;
pub mod limits;
pub mod mend;
pub mod one_law;
pub mod rescue;
pub mod ties;

use std::iter;

use framework::Exercise;

/// All exercises in their order. Of one with several questions this is the first.
pub const ALL: [&dyn Exercise; 12] = [
    &cliff::Cliff,
    &deeper_queue::DeeperQueue,
    &ties::Ties,
    &limits::Limits,
    &rescue::Rescue,
    &one_law::AT_50_HZ,
    &deep_queue::TIME,
    &jitter::Jitter,
    &hold_or_zero::HOLD,
    &fault::FaultExercise,
    &build::Build,
    &mend::Mend,
];

/// The exercise with this number, counted from one: its first question.
pub fn find(number: u32) -> Option<&'static dyn Exercise> {
    let mut all = ALL.into_iter();
    all.find(|exercise| exercise.brief().number == number)
}

/// What `label` names: an exercise with all its questions, such as `6`, or one question,
/// such as `6b`.
pub fn named(label: &str) -> Option<Vec<&'static dyn Exercise>> {
    let whole = label.parse().ok().and_then(find);
    let one = || questions().find(|exercise| exercise.brief().label() == label);
    match whole {
        Some(first) => Some(parts(first).collect()),
        None => one().map(|question| vec![question]),
    }
}

/// The labels of all questions.
pub fn labels() -> String {
    let labels: Vec<String> = questions()
        .map(|exercise| exercise.brief().label())
        .collect();
    labels.join(", ")
}

/// All questions of `exercise`, from this one on.
pub fn parts(exercise: &'static dyn Exercise) -> impl Iterator<Item = &'static dyn Exercise> {
    iter::successors(Some(exercise), |exercise| exercise.next_part())
}

/// The questions of all exercises in their order.
pub fn questions() -> impl Iterator<Item = &'static dyn Exercise> {
    ALL.into_iter().flat_map(parts)
}
