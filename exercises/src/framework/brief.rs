//! What an exercise asks.

use std::fmt;

/// How an exercise is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Say what will happen, then see.
    PredictThenRun,
    /// Turn one knob and find out what it does and does not do.
    Investigation,
    /// Something is wrong: find it.
    BugHunt,
    /// Done by hand in the lab.
    Live,
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::PredictThenRun => "predict, then run",
            Self::Investigation => "investigation",
            Self::BugHunt => "bug hunt",
            Self::Live => "live",
        })
    }
}

/// What a learner reads before the run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Brief {
    /// Its place in the course, counted from one.
    pub number: u32,
    /// One word for it, in files.
    pub name: &'static str,
    /// Its title.
    pub title: &'static str,
    /// How it is done.
    pub kind: Kind,
    /// What it is about and what will be run.
    pub objective: &'static str,
    /// What to predict: one number.
    pub question: &'static str,
    /// The unit of that number; empty for a count.
    pub unit: &'static str,
    /// The numbers that are possible.
    pub range: Range,
}

impl Brief {
    /// `number` with the unit of the question, if that has one.
    pub fn in_unit(&self, number: f64) -> String {
        in_unit(number, self.unit)
    }
}

/// `number` with its `unit`, if it has one.
pub(super) fn in_unit(number: f64, unit: &str) -> String {
    format!("{number} {unit}").trim_end().to_owned()
}

/// The numbers that an exercise can come to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// The least.
    pub least: f64,
    /// The most.
    pub most: f64,
    /// Whether only whole numbers are possible.
    pub whole: bool,
}

impl Range {
    /// Whether `number` is possible.
    pub fn contains(self, number: f64) -> bool {
        (self.least..=self.most).contains(&number) && (!self.whole || number.fract() == 0.0)
    }

    /// The possible numbers in words, in `unit`.
    pub(super) fn in_words(self, unit: &str) -> String {
        let kind = if self.whole { "a whole number, " } else { "" };
        format!("{kind}{} to {}", self.least, in_unit(self.most, unit))
    }
}
