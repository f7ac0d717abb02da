//! Ticks on messages: the topics that trigger a node, which of their messages make a set, and the
//! inputs of its next tick.

mod approximate;

use std::collections::{BTreeMap, VecDeque};

use crate::{
    settings::release::Match,
    time::Time,
    topic::{Intake, TakenMessage},
};
use approximate::Approximate;

/// The sequence numbers of a set of messages, one for each input.
type MessageSet = Vec<u64>;

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

/// Finds the sets among messages that are taken one by one, by the rule of a [`Match`].
#[derive(Clone, Debug)]
struct Matcher {
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
    fn new(matching: Match, inputs: usize) -> Self {
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
    fn add(&mut self, input: usize, taken: TakenMessage, sets: &mut VecDeque<MessageSet>) {
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
    fn needs_from(&self, input: usize) -> Option<u64> {
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
struct Stamped {
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
