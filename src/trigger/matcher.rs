//! Which messages of several topics make a set.

use std::collections::{BTreeMap, VecDeque};

use super::{MessageSet, approximate::Approximate};
use crate::{settings::matching::Match, time::Time, topic::TakenMessage};

/// Finds the sets among messages that are taken one by one, by the rule of a [`Match`].
#[derive(Clone, Debug)]
pub(super) struct Matcher {
    rule: Rule,
    /// The first of so many sets counts.
    every: usize,
    /// Sets since the last one that counted.
    since: usize,
}

/// What makes messages a set.
#[derive(Clone, Debug)]
enum Rule {
    /// Of one topic each message is a set.
    Single,
    Stamped(Stamped),
    Approximate(Approximate),
}

impl Matcher {
    /// Creates a matcher for messages of so many `inputs`, none of which has come.
    pub(super) fn new(matching: Match, inputs: usize) -> Self {
        let every = match matching {
            Match::Every { sets } => sets.get(),
            _ => 1,
        };
        let rule = match matching {
            _ if inputs == 1 => Rule::Single,
            Match::Each | Match::Every { .. } => Rule::Stamped(Stamped::new(inputs, None)),
            Match::Exact { queue } => Rule::Stamped(Stamped::new(inputs, Some(queue.get()))),
            Match::Approximate { queue, interval } => {
                Rule::Approximate(Approximate::new(inputs, queue.get(), interval))
            }
        };
        Self {
            rule,
            every,
            since: 0,
        }
    }

    /// Adds a message; puts the sets that it completes into `sets`.
    pub(super) fn add(
        &mut self,
        input: usize,
        taken: TakenMessage,
        sets: &mut VecDeque<MessageSet>,
    ) {
        match &mut self.rule {
            Rule::Single => sets.push_back(vec![taken.seq]),
            Rule::Stamped(stamped) => sets.extend(stamped.add(input, taken)),
            Rule::Approximate(approximate) => approximate.add(input, taken, sets),
        }
        if self.every > 1 && !sets.is_empty() {
            // The others are passed over as they come.
            if self.since > 0 {
                sets.clear();
            }
            self.since = (self.since + 1) % self.every;
        }
    }

    /// Returns the first message of an input that may still be needed.
    pub(super) fn needs_from(&self, input: usize) -> Option<u64> {
        match &self.rule {
            Rule::Single => None,
            Rule::Stamped(stamped) => stamped.needs_from(input),
            Rule::Approximate(approximate) => approximate.needs_from(input),
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
