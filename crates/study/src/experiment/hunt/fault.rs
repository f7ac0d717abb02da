//! Faults as lists of smallest parts.

use std::time::Duration;

use ratelab::{Knob, Time, TimedKnob};

use super::{Budget, HuntError, MOST_PARTS, SHIFT_UNIT, UNIT};

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
    /// The node that may be shifted is due a [`SHIFT_UNIT`] later.
    Shift,
}

/// The number of parts of a length of `unit` in `duration`.
pub(super) fn parts(duration: Duration, unit: Duration) -> usize {
    let parts = duration.as_nanos() / unit.as_nanos();
    usize::try_from(parts).unwrap_or(usize::MAX)
}

impl Budget {
    /// The number of parts of each kind: lost and late messages, those of a hang and of a shift.
    pub(super) fn parts(&self) -> [usize; 4] {
        let most = |of: &Option<(String, Duration)>, unit| {
            of.as_ref().map_or(0, |(_, longest)| parts(*longest, unit))
        };
        let (hang, shift) = (most(&self.hang, UNIT), most(&self.shift, SHIFT_UNIT));
        [self.lose, parts(self.delay, UNIT), hang, shift]
    }

    /// Whether `list` is within it.
    pub(super) fn allows(&self, list: &[FaultPart]) -> bool {
        let kinds: [fn(&FaultPart) -> bool; 4] = [
            |part| matches!(part, FaultPart::Lost(_)),
            |part| matches!(part, FaultPart::Late(_)),
            |part| matches!(part, FaultPart::Hang(_)),
            |part| matches!(part, FaultPart::Shift),
        ];
        let mut kinds = kinds.iter().zip(self.parts());
        kinds.all(|(kind, most)| list.iter().filter(|part| kind(part)).count() <= most)
    }

    /// Refuses an empty budget, and one with too many parts.
    pub(super) fn check(&self) -> Result<(), HuntError> {
        match self.parts() {
            [0, 0, 0, 0] => Err(HuntError::NoBudget),
            parts if parts.iter().any(|count| *count > MOST_PARTS) => Err(HuntError::TooMuch),
            _ => Ok(()),
        }
    }

    /// The knobs for the faults of `list`.
    pub(super) fn knobs(&self, list: &[FaultPart]) -> Vec<TimedKnob> {
        let mut list = list.to_vec();
        list.sort_unstable();
        let same = list.chunk_by(|one, next| one == next);
        let knobs = same.map(|same| self.knob(same[0], same.len() as u32));
        let mut knobs: Vec<_> = knobs.collect();
        knobs.sort_by_key(|timed| timed.at);
        knobs
    }

    fn knob(&self, part: FaultPart, times: u32) -> TimedKnob {
        let (topic, delay) = (self.topic.clone(), UNIT * times);
        let (at, knob) = match part {
            FaultPart::Lost(seq) => (Time::ZERO, Knob::Lose { topic, seq }),
            FaultPart::Late(seq) => (Time::ZERO, Knob::Postpone { topic, seq, delay }),
            FaultPart::Hang(at) => {
                let node = self.hang.as_ref().map(|(node, _)| node.clone());
                let (node, cost) = (node.unwrap_or_default(), delay);
                (at, Knob::Hang { node, cost })
            }
            FaultPart::Shift => {
                let node = self.shift.as_ref().map(|(node, _)| node.clone());
                let (node, offset) = (node.unwrap_or_default(), self.offset + SHIFT_UNIT * times);
                (Time::ZERO, Knob::Offset { node, offset })
            }
        };
        TimedKnob { at, knob }
    }
}
