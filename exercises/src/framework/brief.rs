//! The text of an exercise.

use std::fmt;

use super::{tolerance::Tolerance, unit::in_unit};

/// Kind of an exercise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExerciseKind {
    /// Predict the result, then run.
    PredictThenRun,
    /// Change one knob and investigate its effect.
    Investigation,
    /// Find an error.
    BugHunt,
    /// By hand, in the lab.
    Live,
    /// Write the code.
    Build,
}

impl fmt::Display for ExerciseKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::PredictThenRun => "predict, then run",
            Self::Investigation => "investigation",
            Self::BugHunt => "bug hunt",
            Self::Live => "live",
            Self::Build => "build",
        })
    }
}

/// The text for the learner before the run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Brief {
    /// Number in the course, counted from one.
    pub number: u32,
    /// A letter for each question of an exercise with several; otherwise empty.
    pub part: &'static str,
    /// A one-word name, for files.
    pub name: &'static str,
    /// Its title.
    pub title: &'static str,
    /// Kind of the exercise.
    pub kind: ExerciseKind,
    /// The subject, and the planned runs.
    pub objective: &'static str,
    /// The question: one number to predict, or one of the choices.
    pub question: &'static str,
    /// The quantity that the number is of, in a word or two.
    pub quantity: &'static str,
    /// Unit of the number; empty for a count.
    pub unit: &'static str,
    /// How near a right prediction comes.
    pub tolerance: Tolerance,
    /// The possible numbers.
    pub range: Range,
    /// The possible answers in words, numbered from one; empty for a question about a
    /// number.
    pub choices: &'static [&'static str],
}

impl Brief {
    /// The number with the letter of the question, such as `6b`.
    pub fn label(&self) -> String {
        format!("{}{}", self.number, self.part)
    }

    /// `number` with the unit of the question if there is one, or the choice of that
    /// number.
    pub fn in_unit(&self, number: f64) -> String {
        match self.choice(number) {
            Some(choice) => choice.to_owned(),
            None => in_unit(number, self.unit),
        }
    }

    /// The question, with how near a right number comes, or with the choices.
    pub fn asked(&self) -> String {
        match self.choices {
            [] => {
                let right = self.tolerance.in_words(self.quantity, self.unit);
                format!("{}\n{right}", self.question)
            }
            choices => format!("{}\nOne of: {}.", self.question, choices.join(", ")),
        }
    }

    fn choice(&self, number: f64) -> Option<&'static str> {
        let index = (number as usize).checked_sub(1)?;
        self.choices.get(index).copied()
    }
}

/// The possible results of an exercise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// The least number.
    pub least: f64,
    /// The greatest number.
    pub most: f64,
    /// Whether only whole numbers are possible.
    pub whole: bool,
}

impl Range {
    /// Whether `number` is possible.
    pub fn contains(self, number: f64) -> bool {
        (self.least..=self.most).contains(&number) && (!self.whole || number.fract() == 0.0)
    }

    /// The numbers of `choices`.
    pub const fn of(choices: &[&str]) -> Self {
        Self {
            least: 1.0,
            most: choices.len() as f64,
            whole: true,
        }
    }

    /// The possible numbers as text, in `unit`.
    pub(super) fn in_words(self, unit: &str) -> String {
        let kind = if self.whole { "a whole number, " } else { "" };
        format!("{kind}{} to {}", self.least, in_unit(self.most, unit))
    }
}
