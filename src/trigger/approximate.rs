//! Messages with the closest stamps.

use std::{collections::VecDeque, time::Duration};

use super::MessageSet;
use crate::{time::Time, topic::TakenMessage};

/// Tenths of `1 + age_penalty`, whose default is 0.1: a later set must be closer together.
const PENALTY_TENTHS: i128 = 11;

/// Searches the messages for the closest set (`approximate_time.hpp`, message_filters
/// `361e42c`): each message is in one set at most, and sets do not cross.
#[derive(Clone, Debug)]
pub(super) struct Approximate {
    /// The most messages of a topic that wait.
    queue: usize,
    /// The longest interval within a set.
    longest: Duration,
    topics: Vec<HeldMessages>,
    search: Option<Search>,
}

/// The messages of a topic, oldest first.
#[derive(Clone, Debug, Default)]
struct HeldMessages {
    messages: VecDeque<TakenMessage>,
    /// Number of these that the search has passed.
    past: usize,
    /// Whether the queue was too short for one, so that the head may be a bad pivot.
    dropped: bool,
    /// Stamp of the newest message so far.
    newest: Time,
}

impl HeldMessages {
    /// Returns the first message that the search has not passed.
    fn head(&self) -> Option<TakenMessage> {
        self.messages.get(self.past).copied()
    }
}

/// The best set so far.
#[derive(Clone, Debug)]
struct Search {
    choice: MessageSet,
    start: Time,
    end: Time,
    /// The latest message of the first set: every better one begins there or before.
    pivot: Boundary,
}

/// The topic of a boundary of a set, and the stamp there.
type Boundary = (usize, Time);

impl Approximate {
    pub(super) fn new(inputs: usize, queue: usize, longest: Duration) -> Self {
        let topics = (0..inputs).map(|_| HeldMessages::default());
        Self {
            queue,
            longest,
            topics: topics.collect(),
            search: None,
        }
    }

    /// Adds a message; puts the sets that it completes into `sets`.
    pub(super) fn add(
        &mut self,
        input: usize,
        taken: TakenMessage,
        sets: &mut VecDeque<MessageSet>,
    ) {
        let topic = &mut self.topics[input];
        topic.messages.push_back(taken);
        topic.newest = taken.sensed;
        if topic.messages.len() - topic.past == 1 {
            self.process(sets);
        }
        if self.topics[input].messages.len() > self.queue {
            self.overflow(input, sets);
        }
    }

    pub(super) fn needs_from(&self, input: usize) -> Option<u64> {
        self.topics[input].messages.front().map(|taken| taken.seq)
    }

    /// Gives the search up and drops the oldest message of a topic.
    fn overflow(&mut self, input: usize, sets: &mut VecDeque<MessageSet>) {
        self.topics.iter_mut().for_each(|topic| topic.past = 0);
        self.topics[input].messages.pop_front();
        self.topics[input].dropped = true;
        if self.search.take().is_some() {
            self.process(sets);
        }
    }

    /// Searches on while every topic has a message.
    fn process(&mut self, sets: &mut VecDeque<MessageSet>) {
        while let Some(((start_of, start), (end_of, end))) = self.boundaries() {
            for (index, topic) in self.topics.iter_mut().enumerate() {
                topic.dropped &= index == end_of;
            }
            let pivot = match &self.search {
                None if end.since(start) > self.longest || self.topics[end_of].dropped => {
                    self.topics[start_of].messages.pop_front();
                    continue;
                }
                None => (end_of, end),
                Some(best) => best.pivot,
            };
            if self
                .search
                .as_ref()
                .is_none_or(|best| best.is_beaten_by(start, end))
            {
                self.keep(start, end, pivot);
            }
            self.topics[start_of].past += 1;
            if start_of == pivot.0 || self.has_no_better(end) {
                sets.extend(self.finish());
            }
        }
    }

    /// Returns the earliest and the latest head; `None` if a topic has none.
    fn boundaries(&self) -> Option<(Boundary, Boundary)> {
        let heads = self.topics.iter().map(|topic| Some(topic.head()?.sensed));
        boundaries_of(heads.collect::<Option<_>>()?)
    }

    /// Returns whether no set can be better than the best one, now that heads end at `end`: a topic
    /// without a head has its next one at the pivot and after its newest at the earliest.
    fn has_no_better(&self, end: Time) -> bool {
        let Some(best) = &self.search else {
            return false;
        };
        if best.is_best_from(end) {
            return true;
        }
        if self.topics.iter().all(|topic| topic.head().is_some()) {
            return false;
        }
        let mut past: Vec<usize> = self.topics.iter().map(|topic| topic.past).collect();
        loop {
            let at = |(topic, past): (&HeldMessages, &usize)| match topic.messages.get(*past) {
                Some(taken) => taken.sensed,
                None => best.pivot.1.max(topic.newest),
            };
            let heads = self.topics.iter().zip(&past).map(at).collect();
            let Some(((start_of, start), (_, end))) = boundaries_of(heads) else {
                return false;
            };
            if best.is_best_from(end) {
                return true;
            }
            // So it is also where the start is a message to come.
            if best.is_beaten_by(start, end) {
                return false;
            }
            past[start_of] += 1;
        }
    }

    /// Takes the heads as the best set; the messages before them are used up.
    fn keep(&mut self, start: Time, end: Time, pivot: Boundary) {
        for topic in &mut self.topics {
            topic.messages.drain(..topic.past);
            topic.past = 0;
        }
        let heads = self.topics.iter().filter_map(HeldMessages::head);
        self.search = Some(Search {
            choice: heads.map(|taken| taken.seq).collect(),
            start,
            end,
            pivot,
        });
    }

    /// Ends the search: the messages of the best set are used up.
    fn finish(&mut self) -> Option<MessageSet> {
        for topic in &mut self.topics {
            topic.messages.pop_front();
            topic.past = 0;
        }
        Some(self.search.take()?.choice)
    }
}

impl Search {
    /// Returns whether the set from `start` to `end` is better.
    fn is_beaten_by(&self, start: Time, end: Time) -> bool {
        self.penalty(end) < 10 * nanos_between(self.start, start)
    }

    /// Returns whether no set is better that ends at `end` or later: with the pivot, it begins at
    /// the pivot or before.
    fn is_best_from(&self, end: Time) -> bool {
        !self.is_beaten_by(self.pivot.1, end)
    }

    /// Ten times the penalty of a set that ends at `end`.
    fn penalty(&self, end: Time) -> i128 {
        PENALTY_TENTHS * nanos_between(self.end, end)
    }
}

fn nanos_between(from: Time, to: Time) -> i128 {
    i128::from(to.as_nanos()) - i128::from(from.as_nanos())
}

/// Returns the first of the earliest heads, and the last of the latest.
fn boundaries_of(heads: Vec<Time>) -> Option<(Boundary, Boundary)> {
    let heads = || heads.iter().copied().enumerate();
    let start = heads().min_by_key(|(_, at)| *at)?;
    let end = heads().max_by_key(|(_, at)| *at)?;
    Some((start, end))
}
