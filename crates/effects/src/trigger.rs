//! Ticks on messages: the topics that trigger a node, and the inputs of its next tick.

use std::collections::VecDeque;

use ratelab::{Intake, Time, Timetable};

use super::{choice::Choice, matcher::Matcher, matching::Match};

/// The topics that trigger a node.
pub(crate) struct Trigger {
    inputs: Vec<Box<dyn Intake>>,
    sets: Matcher,
    /// The sets that a message completed beyond one, for ticks of their own.
    more: More,
    matching: Match,
    /// The input whose turn it is.
    turn: usize,
}

/// Sets of one message, for the ticks that follow.
#[derive(Debug, Default)]
struct More {
    sets: VecDeque<Choice>,
    /// The input with that message, and the run time of its delivery.
    input: usize,
    arrived: Time,
}

impl Trigger {
    pub(crate) fn new(matching: Match, inputs: Vec<Box<dyn Intake>>) -> Self {
        Self {
            sets: Matcher::new(matching, inputs.len()),
            inputs,
            more: More::default(),
            matching,
            turn: 0,
        }
    }

    /// Number of the topics.
    pub(crate) fn inputs(&self) -> usize {
        self.inputs.len()
    }

    /// Forgets the messages taken so far.
    pub(crate) fn reset(&mut self) {
        self.sets = Matcher::new(self.matching, self.inputs.len());
        self.more = More::default();
        let inputs = self.inputs.iter_mut();
        inputs.for_each(|input| input.forget_before(None));
        self.turn = 0;
    }

    /// Run time of the delivery of the oldest message that an input has not yet taken.
    pub(crate) fn oldest_of(&self, input: usize, now: Time) -> Option<Time> {
        let more = &self.more;
        if more.input == input && !more.sets.is_empty() {
            return Some(more.arrived);
        }
        self.inputs.get(input)?.oldest(now)
    }

    /// The same for all inputs.
    pub(crate) fn oldest(&self, now: Time) -> Option<Time> {
        let inputs = 0..self.inputs.len();
        inputs.filter_map(|input| self.oldest_of(input, now)).min()
    }

    /// Whether a message waits.
    pub(crate) fn waits(&self, now: Time) -> bool {
        (0..self.inputs.len()).any(|input| self.oldest_of(input, now).is_some())
    }

    /// Number of messages that an input may take at `now`.
    pub(crate) fn waiting_in(&self, input: usize, now: Time) -> usize {
        let more = match self.more.input == input {
            true => self.more.sets.len(),
            false => 0,
        };
        more + self.inputs[input].waiting(now)
    }

    /// Takes the oldest message of an input. Returns the run time of its delivery if it
    /// completes a set: the node, which is this member of its crew, is to tick.
    pub(crate) fn take_from(
        &mut self,
        input: usize,
        member: usize,
        plan: &mut Timetable<'_>,
    ) -> Option<Time> {
        let (choice, arrived) = match self.more.sets.pop_front() {
            // Its own message waits for the next call.
            Some(choice) => (Some(choice), self.more.arrived),
            None => {
                let taken = self.inputs.get_mut(input)?.take(plan.now())?;
                let choice = self.sets.add(input, taken, &mut self.more.sets);
                (self.more.input, self.more.arrived) = (input, taken.arrived);
                (choice, taken.arrived)
            }
        };
        for (index, input) in self.inputs.iter_mut().enumerate() {
            if let Some(choice) = &choice {
                input.choose(choice[index]);
            }
            let waiting = self.more.sets.front().map(|set| set[index]);
            input.forget_before(waiting.or_else(|| self.sets.needs_from(index)));
        }
        if input != self.more.input || !self.more.sets.is_empty() {
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
