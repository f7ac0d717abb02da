//! Predictions against measurements. Each exercise is measured once, when the first
//! prediction of it is read.

use std::collections::BTreeMap;

use exercises::{
    ALL,
    framework::{Answers, Brief, Findings},
};

use crate::error::Error;

/// A graded prediction.
pub struct Mark {
    /// The exercise.
    pub brief: &'static Brief,
    /// The predicted number, in the unit of the question.
    pub number: f64,
    /// The reason in the learner's words.
    pub reason: String,
    /// Whether the prediction is right.
    pub right: bool,
    /// Its deviation, as text.
    pub by: String,
}

impl Mark {
    /// Whether `other` has the same words as a reason, and more than a few.
    pub fn is_worded_like(&self, other: &Self) -> bool {
        let words = |mark: &Self| {
            let words = mark.reason.split(|c: char| !c.is_alphanumeric());
            let words = words.filter(|word| !word.is_empty()).map(str::to_lowercase);
            words.collect::<Vec<_>>()
        };
        let mine = words(self);
        mine.len() >= TELLING && mine == words(other)
    }
}

/// Number of words from which on the same reason is worth a note.
const TELLING: usize = 5;

/// The measured exercises.
#[derive(Default)]
pub struct Measured(BTreeMap<u32, Findings>);

impl Measured {
    /// Grades all predictions in `answers`, in the order of the exercises.
    ///
    /// # Errors
    /// [`Error`] if an exercise cannot be measured.
    pub fn marks(&mut self, answers: &Answers) -> Result<Vec<Mark>, Error> {
        let mut marks = Vec::new();
        for exercise in ALL {
            let brief = exercise.brief();
            let Some(prediction) = answers.get(brief) else {
                continue;
            };
            if !self.0.contains_key(&brief.number) {
                self.0.insert(brief.number, exercise.run()?);
            }
            let (right, by) = self.0[&brief.number].judge(brief, prediction);
            marks.push(Mark {
                brief,
                number: prediction.number(),
                reason: prediction.reason().to_owned(),
                right,
                by,
            });
        }
        Ok(marks)
    }

    /// The exercises with a prediction, and their results.
    pub fn exercises(&self) -> impl Iterator<Item = (&'static Brief, &Findings)> {
        let all = ALL.into_iter().map(|exercise| exercise.brief());
        all.filter_map(|brief| Some((brief, self.0.get(&brief.number)?)))
    }
}
