//! Which messages of several topics make a set.

use std::collections::{BTreeMap, VecDeque};

use super::{MessageSet, approximate::Approximate};
use crate::{settings::matching::Match, time::Time, topic::TakenMessage};

/// Finds the sets among messages that are taken one by one, by the rule of a [`Match`].
#[derive(Clone, Debug)]
pub(super) enum Matcher {
    /// Of one topic each message is a set.
    Single,
    Stamped(Stamped),
    Approximate(Approximate),
}

impl Matcher {
    /// A matcher for messages of so many `inputs`, none of which has come.
    pub(super) fn new(matching: Match, inputs: usize) -> Self {
        match matching {
            _ if inputs == 1 => Self::Single,
            Match::Each => Self::Stamped(Stamped::new(inputs, None)),
            Match::Exact { queue } => Self::Stamped(Stamped::new(inputs, Some(queue.get()))),
            Match::Approximate { queue, interval } => {
                Self::Approximate(Approximate::new(inputs, queue.get(), interval))
            }
        }
    }

    /// Adds a message; puts the sets that it completes into `sets`.
    pub(super) fn add(
        &mut self,
        input: usize,
        taken: TakenMessage,
        sets: &mut VecDeque<MessageSet>,
    ) {
        match self {
            Self::Single => sets.push_back(vec![taken.seq]),
            Self::Stamped(stamped) => sets.extend(stamped.add(input, taken)),
            Self::Approximate(approximate) => approximate.add(input, taken, sets),
        }
    }

    /// The first message of an input that may still be needed.
    pub(super) fn needs_from(&self, input: usize) -> Option<u64> {
        match self {
            Self::Single => None,
            Self::Stamped(stamped) => stamped.needs_from(input),
            Self::Approximate(approximate) => approximate.needs_from(input),
        }
    }
}

/// Collects messages by their stamps (`exact_time.hpp:88-169`, message_filters `361e42c`); or as if
/// all had one stamp, so that a set is complete with the newest of each topic, as in the fusion
/// node of the Autoware reference system (`fusion.hpp`, `de8f3bc`).
#[derive(Clone, Debug)]
pub(super) struct Stamped {
    inputs: usize,
    /// The most stamps that wait; `None` if all are one.
    queue: Option<usize>,
    /// The messages with each stamp.
    sets: BTreeMap<Time, Vec<Option<u64>>>,
}

impl Stamped {
    fn new(inputs: usize, queue: Option<usize>) -> Self {
        Self {
            inputs,
            queue,
            sets: BTreeMap::new(),
        }
    }

    fn add(&mut self, input: usize, taken: TakenMessage) -> Option<MessageSet> {
        let stamp = self.queue.map_or(Time::ZERO, |_| taken.sensed);
        let empty = || vec![None; self.inputs];
        let set = self.sets.entry(stamp).or_insert_with(empty);
        set[input] = Some(taken.seq);
        let all: Option<MessageSet> = set.iter().copied().collect();
        if all.is_some() {
            // Sets with an older stamp stay incomplete.
            self.sets.retain(|known, _| *known > stamp);
        }
        while self.sets.len() > self.queue.unwrap_or(1) {
            self.sets.pop_first();
        }
        all
    }

    fn needs_from(&self, input: usize) -> Option<u64> {
        self.sets.values().filter_map(|set| set[input]).min()
    }
}
