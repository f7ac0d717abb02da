//! Faults as lists of smallest parts.

use std::time::Duration;

use ratelab::{Knob, Time, TimedKnob};

use super::{Budget, HuntError, MOST_PARTS, UNIT};

/// The smallest part of a fault. A longer delay or hang is the same part several times in
/// a list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum FaultPart {
    /// The message with this number is lost.
    Lost(u64),
    /// The message with this number is delivered a [`UNIT`] later.
    Late(u64),
    /// The next tick from this run time on takes one [`UNIT`] per such part in the list.
    Hang(Time),
}

/// The topic and node of the faults.
pub(super) struct Targets {
    topic: String,
    node: String,
}

/// The number of parts in `duration`.
pub(super) fn parts(duration: Duration) -> usize {
    let parts = duration.as_nanos() / UNIT.as_nanos();
    usize::try_from(parts).unwrap_or(usize::MAX)
}

impl Targets {
    /// The targets of `budget`, if they exist.
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

    /// The knobs for the faults of `list`.
    pub fn knobs(&self, list: &[FaultPart]) -> Vec<TimedKnob> {
        let mut list = list.to_vec();
        list.sort_unstable();
        let same = list.chunk_by(|one, next| one == next);
        let knobs = same.map(|same| self.knob(same[0], UNIT * same.len() as u32));
        let mut knobs: Vec<_> = knobs.collect();
        knobs.sort_by_key(|timed| timed.at);
        knobs
    }

    fn knob(&self, part: FaultPart, long: Duration) -> TimedKnob {
        let topic = self.topic.clone();
        let (at, knob) = match part {
            FaultPart::Lost(seq) => (Time::ZERO, Knob::Lose { topic, seq }),
            FaultPart::Late(seq) => {
                let delay = long;
                (Time::ZERO, Knob::Postpone { topic, seq, delay })
            }
            FaultPart::Hang(at) => {
                let (node, cost) = (self.node.clone(), long);
                (at, Knob::Hang { node, cost })
            }
        };
        TimedKnob { at, knob }
    }
}
