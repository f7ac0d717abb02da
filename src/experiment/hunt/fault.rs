//! Faults as lists of the smallest parts that can be left out.

use std::time::Duration;

use super::{Budget, HuntError, MOST_PARTS, UNIT};
use crate::runtime::{Knob, Time, TimedKnob};

/// The smallest part of a fault. Those of a longer delay or hang are in a list several
/// times.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Part {
    /// The message with this number is lost.
    Lost(u64),
    /// The message with this number is delivered a [`UNIT`] later.
    Late(u64),
    /// The next tick from this run time on takes a [`UNIT`] more.
    Hang(Time),
}

/// What the faults are about.
pub(super) struct Targets {
    topic: String,
    node: String,
}

/// How many parts `duration` has.
pub(super) fn parts(duration: Duration) -> usize {
    let parts = duration.as_nanos() / UNIT.as_nanos();
    usize::try_from(parts).unwrap_or(usize::MAX)
}

impl Targets {
    /// Those of `budget`, if there is one.
    pub fn of(budget: &Budget) -> Result<Self, HuntError> {
        let hang = budget.hang.as_ref();
        let counts = [
            budget.lose,
            parts(budget.delay),
            hang.map_or(0, |(_, longest)| parts(*longest)),
        ];
        match counts {
            [0, 0, 0] => Err(HuntError::NoBudget),
            _ if counts.iter().any(|count| *count > MOST_PARTS) => Err(HuntError::TooMuch),
            _ => Ok(Self {
                topic: budget.topic.clone(),
                node: hang.map_or_else(String::new, |(node, _)| node.clone()),
            }),
        }
    }

    /// The knobs that make the faults of `list`.
    pub fn knobs(&self, list: &[Part]) -> Vec<TimedKnob> {
        let mut list = list.to_vec();
        list.sort_unstable();
        let same = list.chunk_by(|one, next| one == next);
        let knobs = same.map(|same| self.knob(same[0], UNIT * same.len() as u32));
        let mut knobs: Vec<_> = knobs.collect();
        knobs.sort_by_key(|timed| timed.at);
        knobs
    }

    fn knob(&self, part: Part, long: Duration) -> TimedKnob {
        let topic = self.topic.clone();
        let (at, knob) = match part {
            Part::Lost(seq) => (Time::ZERO, Knob::Lose { topic, seq }),
            Part::Late(seq) => {
                let delay = long;
                (Time::ZERO, Knob::Postpone { topic, seq, delay })
            }
            Part::Hang(at) => {
                let (node, cost) = (self.node.clone(), long);
                (at, Knob::Hang { node, cost })
            }
        };
        TimedKnob { at, knob }
    }
}
