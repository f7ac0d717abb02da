//! Which messages of several topics make a set.

use std::collections::{BTreeMap, VecDeque};

use ratelab::{TakenMessage, Time};

use super::{
    approximate::Approximate,
    matching::{Choice, Match},
};

/// Finds the sets among messages that are taken one by one, by the rule of a [`Match`].
#[derive(Clone, Debug)]
pub struct Matcher(Rule);

#[derive(Clone, Debug)]
enum Rule {
    /// The fusion node of the Autoware reference system (`fusion.hpp`, `de8f3bc`): all messages
    /// count as of one stamp, so a set is complete with the newest of each topic.
    Each(Stamped),
    Exact(Stamped),
    Approximate(Approximate),
}

impl Matcher {
    /// A matcher for messages of so many `inputs`, none of which has come.
    pub fn new(matching: Match, inputs: usize) -> Self {
        Self(match matching {
            Match::Each => Rule::Each(Stamped::new(inputs, 1)),
            Match::Exact { queue } => Rule::Exact(Stamped::new(inputs, queue.get())),
            Match::Approximate { queue, interval } => {
                Rule::Approximate(Approximate::new(inputs, queue.get(), interval))
            }
        })
    }

    /// Adds a message; returns the set that it completes, and puts any others into `more`.
    pub fn add(
        &mut self,
        input: usize,
        taken: TakenMessage,
        more: &mut VecDeque<Choice>,
    ) -> Option<Choice> {
        match &mut self.0 {
            Rule::Each(sets) => sets.add(input, taken.seq, Time::ZERO),
            Rule::Exact(sets) => sets.add(input, taken.seq, taken.sensed),
            Rule::Approximate(approximate) => {
                approximate.add(input, taken, more);
                more.pop_front()
            }
        }
    }

    /// The first message of an input that may still be needed.
    pub fn needs_from(&self, input: usize) -> Option<u64> {
        match &self.0 {
            Rule::Each(sets) | Rule::Exact(sets) => sets.needs_from(input),
            Rule::Approximate(approximate) => approximate.needs_from(input),
        }
    }
}

/// Collects messages by their stamps (`exact_time.hpp:88-169`, message_filters `361e42c`).
#[derive(Clone, Debug)]
struct Stamped {
    inputs: usize,
    /// The most stamps that wait.
    queue: usize,
    /// The messages with each stamp.
    sets: BTreeMap<Time, Vec<Option<u64>>>,
}

impl Stamped {
    fn new(inputs: usize, queue: usize) -> Self {
        Self {
            inputs,
            queue,
            sets: BTreeMap::new(),
        }
    }

    fn add(&mut self, input: usize, seq: u64, stamp: Time) -> Option<Choice> {
        let empty = || vec![None; self.inputs];
        let set = self.sets.entry(stamp).or_insert_with(empty);
        set[input] = Some(seq);
        let all: Option<Choice> = set.iter().copied().collect();
        if all.is_some() {
            // Sets with an older stamp stay incomplete.
            self.sets.retain(|known, _| *known > stamp);
        }
        while self.sets.len() > self.queue {
            self.sets.pop_first();
        }
        all
    }

    fn needs_from(&self, input: usize) -> Option<u64> {
        self.sets.values().filter_map(|set| set[input]).min()
    }
}
