//! Ticks on messages: the topics that trigger a node, and the inputs of its next tick.
//!
//! A message is taken when the executor calls the node, as a ROS subscription's callback
//! takes it: one message for each call, the oldest that its queue keeps. Once the messages
//! taken make a set ([`Matching`]), the node ticks, and its subscriptions read that set.

mod arrivals;
mod sets;

pub(crate) use arrivals::{Arrival, Arrivals, Wake};
pub use sets::{Choice, Matching, Sets, TakenMessage};

use std::collections::VecDeque;

use super::{sync::Arc, time::Time};

/// A topic that triggers a node, regardless of its payload.
pub(crate) trait Intake: Send {
    /// Run time of the delivery of the oldest message that was not yet taken.
    fn oldest(&self, now: Time) -> Option<Time>;

    /// Number of messages that are there at `now`, or nearly so: a look without a turn.
    fn waiting(&self, now: Time) -> usize;

    /// Takes that message.
    fn take(&mut self, now: Time) -> Option<TakenMessage>;

    /// Lets the subscription read the message taken as number `seq`.
    fn choose(&mut self, seq: u64);

    /// Forgets the messages taken before number `seq`; all of them without a `seq`.
    fn forget_before(&mut self, seq: Option<u64>);

    /// Has the node called once more at run time `now`, as if a message arrived.
    fn call_again(&self, now: Time);
}

/// The topics that trigger a node.
pub(crate) struct Trigger {
    inputs: Vec<Box<dyn Intake>>,
    sets: Box<dyn Sets>,
    /// The sets that a message completed beyond one, for ticks of their own.
    more: More,
    matching: Arc<dyn Matching>,
    /// The input whose turn it is.
    turn: usize,
    /// The only input of the next call, where an executor decides that.
    chosen: Option<usize>,
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
    pub(crate) fn new(matching: Arc<dyn Matching>, inputs: Vec<Box<dyn Intake>>) -> Self {
        Self {
            sets: matching.sets(inputs.len()),
            inputs,
            more: More::default(),
            matching,
            turn: 0,
            chosen: None,
        }
    }

    /// Number of the topics.
    pub(crate) fn inputs(&self) -> usize {
        self.inputs.len()
    }

    /// Forgets the messages taken so far.
    pub(crate) fn reset(&mut self) {
        self.sets = self.matching.sets(self.inputs.len());
        self.more = More::default();
        let inputs = self.inputs.iter_mut();
        inputs.for_each(|input| input.forget_before(None));
        self.turn = 0;
        self.chosen = None;
    }

    /// Run time of the delivery of the oldest message that an input has not yet taken.
    pub(crate) fn oldest_of(&self, input: usize, now: Time) -> Option<Time> {
        let more = &self.more;
        if more.input == input && !more.sets.is_empty() {
            return Some(more.arrived);
        }
        self.inputs[input].oldest(now)
    }

    /// The same for all inputs.
    pub(crate) fn oldest(&self, now: Time) -> Option<Time> {
        let inputs = 0..self.inputs.len();
        inputs.filter_map(|input| self.oldest_of(input, now)).min()
    }

    /// Number of messages that an input may take at `now`.
    pub(crate) fn waiting_in(&self, input: usize, now: Time) -> usize {
        let more = match self.more.input == input {
            true => self.more.sets.len(),
            false => 0,
        };
        more + self.inputs[input].waiting(now)
    }

    /// Has the next [`take`](Self::take) be of this input only.
    pub(crate) fn choose_input(&mut self, input: usize) {
        self.chosen = Some(input).filter(|input| *input < self.inputs.len());
    }

    /// Takes the oldest message of an input. Returns the run time of its delivery if it
    /// completes a set: the node is to tick.
    pub(crate) fn take_from(&mut self, input: usize, now: Time) -> Option<Time> {
        let (choice, arrived) = match self.more.sets.pop_front() {
            // Its own message waits for the next call.
            Some(choice) => (Some(choice), self.more.arrived),
            None => {
                let taken = self.inputs[input].take(now)?;
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
            self.inputs[input].call_again(now);
        }
        choice.map(|_| arrived)
    }

    /// Takes messages, one of each input in turn, until a set is complete; returns the run
    /// time of the delivery of its last one. Takes one message if an input is chosen.
    pub(crate) fn take(&mut self, now: Time) -> Option<Time> {
        if let Some(input) = self.chosen.take() {
            return self.take_from(input, now);
        }
        let mut empty = 0;
        while empty < self.inputs.len() {
            let input = self.turn;
            self.turn = (input + 1) % self.inputs.len();
            match self.oldest_of(input, now) {
                None => empty += 1,
                Some(_) => {
                    empty = 0;
                    if let Some(due) = self.take_from(input, now) {
                        return Some(due);
                    }
                }
            }
        }
        None
    }
}
