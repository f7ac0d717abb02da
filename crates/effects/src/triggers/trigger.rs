//! Ticks on messages: the topics that trigger a node, and the inputs of its next tick.

use std::collections::VecDeque;

use ratelab::{Intake, Time, Timetable};

use super::{
    matcher::Matcher,
    matching::{Choice, Match},
};

/// The topics that trigger a node.
pub(crate) struct Trigger {
    inputs: Vec<Box<dyn Intake>>,
    matching: Match,
    matcher: Matcher,
    /// The sets that the last message completed, but for those that were used.
    sets: VecDeque<Choice>,
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

    /// Number of the topics.
    pub(crate) fn inputs(&self) -> usize {
        self.inputs.len()
    }

    /// Forgets the messages taken so far.
    pub(crate) fn reset(&mut self) {
        let inputs = std::mem::take(&mut self.inputs);
        *self = Self::new(self.matching, inputs);
        let inputs = self.inputs.iter_mut();
        inputs.for_each(|input| input.forget_before(None));
    }

    /// Run time of the delivery of the oldest message that an input has not yet taken. One that
    /// has completed several sets is as good as many.
    pub(crate) fn oldest_of(&self, input: usize, now: Time) -> Option<Time> {
        match self.last {
            (last, arrived) if last == input && !self.sets.is_empty() => Some(arrived),
            _ => self.inputs.get(input)?.oldest(now),
        }
    }

    /// Run time of the delivery of the oldest message on any input.
    pub(crate) fn oldest(&self, now: Time) -> Option<Time> {
        let inputs = 0..self.inputs.len();
        inputs.filter_map(|input| self.oldest_of(input, now)).min()
    }

    /// Number of messages that an input may take at `now`.
    pub(crate) fn waiting_in(&self, input: usize, now: Time) -> usize {
        let more = match self.last.0 == input {
            true => self.sets.len(),
            false => 0,
        };
        more + self.inputs[input].waiting(now)
    }

    /// Takes the oldest message of an input, unless one before completed several sets. Returns the
    /// run time of its delivery if there is a set: the node, which is this member of its task set,
    /// is to tick.
    pub(crate) fn take_from(
        &mut self,
        input: usize,
        member: usize,
        plan: &mut Timetable<'_>,
    ) -> Option<Time> {
        if self.sets.is_empty() {
            let taken = self.inputs.get_mut(input)?.take(plan.now())?;
            self.matcher.add(input, taken, &mut self.sets);
            self.last = (input, taken.arrived);
        }
        let choice = self.sets.pop_front();
        for (index, input) in self.inputs.iter_mut().enumerate() {
            if let Some(choice) = &choice {
                input.choose(choice[index]);
            }
            let waiting = self.sets.front().map(|set| set[index]);
            input.forget_before(waiting.or_else(|| self.matcher.needs_from(index)));
        }
        let (last, arrived) = self.last;
        if input != last || !self.sets.is_empty() {
            // The node is called once more, as if a message arrived.
            plan.arrive(member, input);
        }
        choice.map(|_| arrived)
    }

    /// Takes messages, one of each input in turn, until a set is complete; returns the run
    /// time of the delivery of its last one.
    pub(crate) fn take(&mut self, member: usize, plan: &mut Timetable<'_>) -> Option<Time> {
        let mut empty = 0;
        while empty < self.inputs.len() {
            let input = self.turn;
            self.turn = (input + 1) % self.inputs.len();
            match self.oldest_of(input, plan.now()) {
                None => empty += 1,
                Some(_) => {
                    empty = 0;
                    if let Some(due) = self.take_from(input, member, plan) {
                        return Some(due);
                    }
                }
            }
        }
        None
    }
}
