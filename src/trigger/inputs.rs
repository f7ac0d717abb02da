//! Ticks on messages: the topics that trigger a node, and the inputs of its next tick.

use std::collections::VecDeque;

use super::{MessageSet, matcher::Matcher};
use crate::{settings::matching::Match, time::Time, topic::Intake};

/// The topics that trigger a node.
pub(crate) struct Trigger {
    inputs: Vec<Box<dyn Intake>>,
    matching: Match,
    matcher: Matcher,
    /// The sets that the last message completed and that were not yet used.
    sets: VecDeque<MessageSet>,
    /// The input with that message, and the run time of its delivery.
    last: (usize, Time),
    /// The input whose turn it is.
    turn: usize,
}

impl Trigger {
    pub(crate) fn new(matching: Match, inputs: Vec<Box<dyn Intake>>) -> Self {
        Self {
            matcher: Matcher::new(matching, inputs.len()),
            inputs,
            matching,
            sets: VecDeque::new(),
            last: (0, Time::ZERO),
            turn: 0,
        }
    }

    /// Returns the number of the topics.
    pub(crate) fn inputs(&self) -> usize {
        self.inputs.len()
    }

    /// Forgets the messages taken so far.
    pub(crate) fn reset(&mut self) {
        let inputs = std::mem::take(&mut self.inputs);
        *self = Self::new(self.matching, inputs);
        self.inputs
            .iter_mut()
            .for_each(|input| input.forget_before(None));
    }

    /// Returns whether the last message completed sets that were not yet used.
    pub(crate) fn has_sets(&self) -> bool {
        !self.sets.is_empty()
    }

    /// Returns the run time of the delivery of the oldest message that an input has not yet taken.
    pub(crate) fn oldest_of(&self, input: usize, now: Time) -> Option<Time> {
        self.inputs.get(input)?.oldest(now)
    }

    /// Returns the run time of the delivery of the message that the node works on next: the last one
    /// while it has sets, else the oldest on any input.
    pub(crate) fn oldest(&self, now: Time) -> Option<Time> {
        if self.has_sets() {
            return Some(self.last.1);
        }
        self.inputs
            .iter()
            .filter_map(|input| input.oldest(now))
            .min()
    }

    /// Returns the number of messages that an input may take at `now`.
    pub(crate) fn waiting_in(&self, input: usize, now: Time) -> usize {
        self.inputs[input].waiting(now)
    }

    /// Takes the oldest message of an input. Returns the run time of its delivery if it completes
    /// a set: the node is to tick.
    pub(crate) fn take_from(&mut self, input: usize, now: Time) -> Option<Time> {
        let taken = self.inputs.get_mut(input)?.take(now)?;
        self.matcher.add(input, taken, &mut self.sets);
        self.last = (input, taken.arrived);
        self.next_set()
    }

    /// Lets the node read the next set of the last message; returns the run time of its delivery.
    fn next_set(&mut self) -> Option<Time> {
        let choice = self.sets.pop_front();
        for (index, input) in self.inputs.iter_mut().enumerate() {
            if let Some(choice) = &choice {
                input.choose(choice[index], index == self.last.0);
            }
            let waiting = self.sets.front().map(|set| set[index]);
            input.forget_before(waiting.or_else(|| self.matcher.needs_from(index)));
        }
        choice.map(|_| self.last.1)
    }

    /// Goes on with the last message if it has sets; else takes messages, one of each input in
    /// turn, until a set is complete. Returns the run time of the delivery of its last one.
    pub(crate) fn take(&mut self, now: Time) -> Option<Time> {
        if self.has_sets() {
            return self.next_set();
        }
        let count = self.inputs.len();
        loop {
            let mut turns = (self.turn..self.turn + count).map(|turn| turn % count);
            let input = turns.find(|input| self.oldest_of(*input, now).is_some())?;
            self.turn = (input + 1) % count;
            if let Some(due) = self.take_from(input, now) {
                return Some(due);
            }
        }
    }
}
