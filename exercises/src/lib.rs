//! Exercises on the rate of a control loop: predict, run, check.
//!
//! Stands on `ratelab`, `ratelab-metrics`, `ratelab-cart-pole`, `ratelab-recording`,
//! `ratelab-experiment` and `ratelab-system`; prints nothing: the command asks and prints. Begin with [`framework`]. A new
//! exercise is a text in `questions.toml`, a module here with a row in `MEASURES`, and its figures in
//! `bands.toml`; the tests name the other places.
//!
//! Each exercise states its objective and asks for one number. After the prediction it
//! runs on the virtual clock, in the ordinary graph, and compares the prediction with the
//! measurement. All printed results are measured in the same run of the program. The
//! expected measurements are in `bands.toml`, each with its source.
//!
//! ```
//! use exercises::framework::Prediction;
//!
//! let exercise = exercises::find(2).expect("there is a second one");
//! println!("{}\n\n{}", exercise.brief().objective, exercise.brief().question);
//! let prediction = Prediction::read("2 because nothing is lost any more", exercise.brief())?;
//! let findings = exercise.run()?;
//! println!("{}\n{}", findings.table, findings.reconcile(exercise.brief(), &prediction));
//! assert!(findings.checks(exercise.brief())?.iter().all(|check| check.holds()));
//! assert_eq!(exercises::questions().len(), 21);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! What a question asks stands in `questions.toml`, what measures it is a module of this crate;
//! [`framework`] is their common part.

#![warn(clippy::print_stderr, clippy::print_stdout)]

mod build;
mod cliff;
mod deep_queue;
mod deeper_queue;
mod fault;
pub mod framework;
mod hold_or_zero;
mod jitter;
mod limits;
mod mend;
mod one_law;
pub mod rescue;
mod slow_policy;
mod ties;

use std::sync::LazyLock;

use framework::{Answers, Brief, Exercise, Measure};
use serde::Deserialize;

/// What measures each question, by the name of its text.
const MEASURES: [(&str, Measure); 21] = [
    ("cliff", Measure::Alike(cliff::measure)),
    ("deeper-queue", Measure::Alike(deeper_queue::measure)),
    ("ties", Measure::Alike(ties::measure)),
    ("limits", Measure::Alike(limits::measure)),
    ("rescue", Measure::Alike(rescue::measure)),
    ("one-law-50", Measure::Alike(one_law::at_50_hz)),
    ("one-law-25", Measure::Alike(one_law::at_25_hz)),
    ("one-law", Measure::Drawn(one_law::law)),
    ("one-law-jitter", Measure::Drawn(one_law::jitter)),
    ("deep-queue", Measure::Alike(deep_queue::time)),
    ("deep-queue-depth", Measure::Alike(deep_queue::depth)),
    ("jitter", Measure::Alike(jitter::same_mean)),
    ("jitter-margin", Measure::Alike(jitter::margin)),
    ("hold", Measure::Alike(hold_or_zero::hold)),
    ("zero", Measure::Alike(hold_or_zero::zero)),
    (
        "fault",
        Measure::Shown {
            measure: fault::measure,
            scene: fault::scene,
            evidence: fault::evidence,
        },
    ),
    ("build", Measure::Alike(build::measure)),
    ("mend", Measure::Alike(mend::measure)),
    ("slow-chunk", Measure::Alike(slow_policy::chunk)),
    ("slow-knowledge", Measure::Alike(slow_policy::knowledge)),
    ("slow-disturbed", Measure::Alike(slow_policy::disturbed)),
];

/// The texts of all questions.
#[derive(Deserialize)]
struct Texts {
    questions: Vec<Brief>,
}

static QUESTIONS: LazyLock<Vec<Exercise>> = LazyLock::new(|| {
    let texts: Texts =
        toml::from_str(include_str!("../questions.toml")).expect("a part of the program");
    let exercise = |brief: Brief| {
        let mut measures = MEASURES.into_iter();
        let (_, measure) = measures.find(|(name, _)| *name == brief.name)?;
        Some(Exercise::new(brief, measure))
    };
    texts.questions.into_iter().filter_map(exercise).collect()
});

/// Returns the questions of all exercises in their order.
pub fn questions() -> impl ExactSizeIterator<Item = &'static Exercise> {
    QUESTIONS.iter()
}

/// Returns the questions of the exercise with this number, counted from one.
pub fn parts(number: u32) -> impl Iterator<Item = &'static Exercise> {
    questions().filter(move |question| question.brief().number == number)
}

/// Returns the exercise with this number: its first question.
pub fn find(number: u32) -> Option<&'static Exercise> {
    parts(number).next()
}

/// Returns what `label` names: an exercise with all its questions, such as `6`, or one question,
/// such as `6b`; nothing if there is none.
pub fn named(label: &str) -> Vec<&'static Exercise> {
    match label.parse() {
        Ok(number) => parts(number).collect(),
        Err(_) => questions()
            .filter(|question| question.brief().label() == label)
            .collect(),
    }
}

/// Returns the next question for a learner: the first one of the path without a prediction, or else
/// the first one of all.
pub fn next(answers: &Answers) -> Option<&'static Exercise> {
    let is_open = |question: &&Exercise| answers.get(question.brief()).is_none();
    questions()
        .filter(|question| question.brief().path)
        .find(is_open)
        .or_else(|| questions().find(is_open))
}

/// Returns whether there is a first prediction for each question whose answer the limits of the
/// push age on the screen give away.
pub fn has_found_limits(answers: &Answers) -> bool {
    questions()
        .filter(|question| question.brief().asks_limits)
        .all(|question| answers.first(question.brief()).is_some())
}

/// Returns the labels of all questions.
pub fn labels() -> String {
    let labels: Vec<String> = questions()
        .map(|question| question.brief().label())
        .collect();
    labels.join(", ")
}
