//! What helps against a cause, as data: a reader's keys are not known here.

use std::time::Duration;

use ratelab::Knob;

use super::Tried;
use crate::millis::{ms, number};

/// A line on the cause of a loss.
#[derive(Clone, Debug, PartialEq)]
pub struct CauseLine {
    /// What is known.
    pub text: String,
    /// What helps, if anything is known to help.
    pub remedy: Option<Remedy>,
}

impl From<String> for CauseLine {
    fn from(text: String) -> Self {
        Self { text, remedy: None }
    }
}

/// What helps against a cause.
#[derive(Clone, Debug, PartialEq)]
pub enum Remedy {
    /// A knob, and what it did where it was tried.
    Turn(Knob, Effect),
    /// A higher rate, by steps.
    Raise {
        /// The place of the rate among the aliases of rates.
        place: usize,
        /// The name of the alias.
        name: &'static str,
    },
    /// Another message in force, such as another policy.
    OtherMessage,
    /// A sentence on what is known without a trial.
    Known(String),
}

/// What a knob did in a trial.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Effect {
    /// It was not tried.
    Untried,
    /// It fixes the run by itself.
    Fixes,
    /// It is needed beside other knobs.
    FixesToo,
    /// It makes the data younger, from an age to a lower one.
    Younger {
        /// The age without it.
        before: Duration,
        /// The age with it.
        after: Duration,
    },
    /// It makes the data older, by this time.
    Older(Duration),
    /// It does not fix the run.
    NotEnough,
}

impl Effect {
    /// Returns what the knob at `place` in the cures did; nothing is known of one without a place.
    pub(super) fn new(tried: Option<&Tried>, place: Option<usize>) -> Self {
        let Some((tried, place)) = tried.zip(place) else {
            return Self::Untried;
        };
        let needed = tried.needed.as_deref();
        let helps = place == 0 && needed.is_none_or(|needed| needed.contains(&place));
        match (needed, tried.ages) {
            (Some([only]), _) if *only == place => Self::Fixes,
            (_, Some([before, after])) if helps && after < before => {
                Self::Younger { before, after }
            }
            (_, Some([before, after])) if place == 0 && before < after => {
                Self::Older(after - before)
            }
            (Some([_, others @ ..]), _) if others.contains(&place) => Self::FixesToo,
            _ => Self::NotEnough,
        }
    }

    /// Returns the sentence on `cure`, a knob as a reader turns it.
    pub fn told(self, cure: &str) -> String {
        match self {
            Self::Untried => format!("try {cure}"),
            Self::Fixes => format!("{cure} fixes it"),
            Self::FixesToo => format!("{cure}, too, fixes it"),
            Self::Younger { before, after } => {
                let taken = number(before - after);
                format!("{cure} takes {taken} of {} away", ms(before))
            }
            Self::Older(by) => format!("{cure} makes it older, by {}", ms(by)),
            Self::NotEnough => format!("{cure} alone is not enough"),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::{Effect, Tried};

    #[test]
    fn only_what_a_trial_showed_is_said_of_a_cure() {
        let ages = |before, after| Some([before, after].map(Duration::from_millis));
        for (needed, ages, place, told) in [
            (Some(vec![0]), None, Some(0), "x fixes it"),
            (Some(vec![0]), None, None, "try x"),
            (
                Some(vec![0, 1]),
                ages(200, 80),
                Some(0),
                "x takes 120 of 200 ms away",
            ),
            (Some(vec![0, 1]), ages(200, 80), Some(1), "x, too, fixes it"),
            (
                Some(vec![1]),
                ages(200, 80),
                Some(0),
                "x alone is not enough",
            ),
            (None, ages(80, 200), Some(0), "x makes it older, by 120 ms"),
            (None, None, Some(0), "x alone is not enough"),
        ] {
            let tried = Tried {
                cures: Vec::new(),
                needed,
                ages,
            };
            assert_eq!(
                Effect::new(Some(&tried), place).told("x"),
                told,
                "{tried:?}"
            );
        }
        assert_eq!(Effect::new(None, Some(0)).told("x"), "try x");
    }
}
