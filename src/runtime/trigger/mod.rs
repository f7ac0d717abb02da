//! Ticks on messages: the topics that trigger a node, and the inputs of its next tick.
//!
//! A message is taken when the executor calls the node, as a ROS subscription's callback
//! takes it: one message for each call, the oldest that its queue keeps. Once the messages
//! taken make a set ([`Match`]), the node ticks, and its subscriptions read that set.

mod arrivals;
mod each;
mod exact;
mod matching;

pub(crate) use arrivals::{Arrival, Arrivals, Wake};
pub use matching::Match;

use self::{each::Each, exact::Exact};
use super::time::Time;

/// A message taken from a queue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Taken {
    pub(crate) seq: u64,
    /// Run time of the sensing behind it.
    pub(crate) sensed: Time,
    /// Run time of its delivery.
    pub(crate) arrived: Time,
}

/// The sequence numbers of a set, one for each input.
type Choice = Vec<u64>;

/// A topic that triggers a node, regardless of its payload.
pub(crate) trait Intake: Send {
    /// Run time of the delivery of the oldest message that was not yet taken.
    fn oldest(&self, now: Time) -> Option<Time>;

    /// Takes that message.
    fn take(&mut self, now: Time) -> Option<Taken>;

    /// Lets the subscription read the message taken as number `seq`.
    fn choose(&mut self, seq: u64);

    /// Forgets the messages taken before number `seq`; all of them without a `seq`.
    fn forget_before(&mut self, seq: Option<u64>);
}

/// The topics that trigger a node.
pub(crate) struct Trigger {
    inputs: Vec<Box<dyn Intake>>,
    sets: Sets,
    matching: Match,
    /// The input whose turn it is.
    turn: usize,
}

/// The messages that wait for the rest of their set.
#[derive(Debug)]
enum Sets {
    Each(Each),
    Exact(Exact),
}

impl Sets {
    fn new(matching: Match, inputs: usize) -> Self {
        match matching {
            Match::Each => Self::Each(Each::new(inputs)),
            Match::Exact { queue } => Self::Exact(Exact::new(inputs, queue.get())),
        }
    }

    fn add(&mut self, input: usize, taken: Taken) -> Option<Choice> {
        match self {
            Self::Each(each) => each.add(input, taken),
            Self::Exact(exact) => exact.add(input, taken),
        }
    }

    fn needs_from(&self, input: usize) -> Option<u64> {
        match self {
            Self::Each(each) => each.needs_from(input),
            Self::Exact(exact) => exact.needs_from(input),
        }
    }
}

impl Trigger {
    pub(crate) fn new(matching: Match, inputs: Vec<Box<dyn Intake>>) -> Self {
        Self {
            sets: Sets::new(matching, inputs.len()),
            inputs,
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
        self.sets = Sets::new(self.matching, self.inputs.len());
        let inputs = self.inputs.iter_mut();
        inputs.for_each(|input| input.forget_before(None));
        self.turn = 0;
    }

    /// Run time of the delivery of the oldest message that an input has not yet taken.
    pub(crate) fn oldest_of(&self, input: usize, now: Time) -> Option<Time> {
        self.inputs[input].oldest(now)
    }

    /// The same for all inputs.
    pub(crate) fn oldest(&self, now: Time) -> Option<Time> {
        let inputs = self.inputs.iter();
        inputs.filter_map(|input| input.oldest(now)).min()
    }

    /// Takes the oldest message of an input. Returns the run time of its delivery if it
    /// completes a set: the node is to tick.
    pub(crate) fn take_from(&mut self, input: usize, now: Time) -> Option<Time> {
        let taken = self.inputs[input].take(now)?;
        let choice = self.sets.add(input, taken);
        for (index, input) in self.inputs.iter_mut().enumerate() {
            if let Some(choice) = &choice {
                input.choose(choice[index]);
            }
            input.forget_before(self.sets.needs_from(index));
        }
        choice.map(|_| taken.arrived)
    }

    /// Takes messages, one of each input in turn, until a set is complete; returns the run
    /// time of the delivery of its last one.
    pub(crate) fn take(&mut self, now: Time) -> Option<Time> {
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
