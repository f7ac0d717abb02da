//! Which messages of several topics make a set.

use std::collections::VecDeque;

use ratelab::TakenMessage;

use super::{
    approximate::Approximate,
    each::Each,
    exact::Exact,
    matching::{Choice, Match},
};

/// Finds the sets among messages that are taken one by one, by the rule of a [`Match`].
#[derive(Clone, Debug)]
pub struct Matcher(Rule);

#[derive(Clone, Debug)]
enum Rule {
    Each(Each),
    Exact(Exact),
    Approximate(Approximate),
}

impl Matcher {
    /// A matcher for messages of so many `inputs`, none of which has come.
    pub fn new(matching: Match, inputs: usize) -> Self {
        Self(match matching {
            Match::Each => Rule::Each(Each::new(inputs)),
            Match::Exact { queue } => Rule::Exact(Exact::new(inputs, queue.get())),
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
            Rule::Each(each) => each.add(input, taken),
            Rule::Exact(exact) => exact.add(input, taken),
            Rule::Approximate(approximate) => {
                approximate.add(input, taken, more);
                more.pop_front()
            }
        }
    }

    /// The first message of an input that may still be needed.
    pub fn needs_from(&self, input: usize) -> Option<u64> {
        match &self.0 {
            Rule::Each(each) => each.needs_from(input),
            Rule::Exact(exact) => exact.needs_from(input),
            Rule::Approximate(approximate) => approximate.needs_from(input),
        }
    }
}
