//! The events to come, in order.

use std::{cmp::Reverse, collections::BinaryHeap};

use crate::time::Time;

/// The order of alarms within one instant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Phase {
    /// Ticks end, by priority. Messages arrive after that, in the order of publication.
    End = 0,
    /// Timers of executors are due, in the order of registration.
    Timer = 2,
    /// Ticks begin of nodes with a thread of their own, by priority.
    Start = 3,
}

impl Phase {
    /// The place of arrivals among the phases.
    const ARRIVE: u64 = 1;
    /// Place of the phase in the order of an item.
    const SHIFT: u32 = 62;
    /// Place of the priority there.
    const PRIORITY: u32 = 30;
}

/// An event of a node. It may have become meaningless since: whoever meets it looks at the
/// node.
#[derive(Clone, Copy, Debug)]
pub(super) struct AgendaItem {
    pub(super) at: Time,
    /// Phase, then priority and number, or the number of an arrival.
    order: u64,
    /// Index of the node.
    pub(super) node: u32,
    /// Number of the topic that a message arrives on, in the list of topics that trigger the node.
    pub(super) input: u32,
}

impl AgendaItem {
    /// Returns the phase of an alarm; `None` for an arrival.
    pub(super) fn phase(&self) -> Option<Phase> {
        use Phase::{End, Start, Timer};
        [Some(End), None, Some(Timer), Some(Start)][(self.order >> Phase::SHIFT) as usize]
    }

    fn rank(&self) -> (Time, u64) {
        (self.at, self.order)
    }
}

/// A run time in the upper half of a number, the index of its bucket in the lower: compared at
/// once.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct InstantKey(u128);

impl InstantKey {
    fn new(at: Time, bucket: usize) -> Self {
        Self(u128::from(at.as_nanos()) << 64 | bucket as u128)
    }

    fn at(self) -> Time {
        Time::from_nanos((self.0 >> 64) as u64)
    }

    fn bucket(self) -> usize {
        self.0 as usize
    }
}

/// The events to come.
///
/// Most are due together with others, at a common rate: so they are kept by their instant, and
/// put in order when that comes.
#[derive(Debug, Default)]
pub(super) struct Agenda {
    /// The events of the last instant that came, in order, with events added for it since.
    batch: Vec<AgendaItem>,
    /// Number of events that are over.
    done: usize,
    /// That instant.
    opened: Time,
    /// The instants after that, each with the index of its bucket.
    instants: BinaryHeap<Reverse<InstantKey>>,
    /// Whether the first of these has come: another takes its place, which costs less than to
    /// remove the one and to add the other.
    is_first_over: bool,
    buckets: Vec<Vec<AgendaItem>>,
    /// The buckets without an instant.
    free: Vec<usize>,
    /// Some of the instants that events were added for lately.
    recent: [(Time, usize); RECENT],
    /// The next of these to be replaced.
    oldest: usize,
    /// Number of arrivals so far.
    arrivals: u64,
}

/// Number of instants that are found without a search. One that is no longer among them gets a
/// second bucket, which does no harm: the buckets of an instant are put in order together.
const RECENT: usize = 4;

impl Agenda {
    /// Adds an event of a node with this priority and number within the phase, to the present instant
    /// if it is for a past one.
    #[inline]
    pub(super) fn add(&mut self, at: Time, phase: Phase, rank: (u32, usize), node: usize) {
        let rank = u64::from(rank.0) << Phase::PRIORITY | rank.1 as u64;
        self.insert(AgendaItem {
            at: at.max(self.opened),
            order: (phase as u64) << Phase::SHIFT | rank,
            node: node as u32,
            input: 0,
        });
    }

    /// Adds the arrival of a message.
    pub(super) fn add_arrival(&mut self, at: Time, node: usize, input: usize) {
        self.arrivals += 1;
        self.insert(AgendaItem {
            at,
            order: Phase::ARRIVE << Phase::SHIFT | self.arrivals,
            node: node as u32,
            input: input as u32,
        });
    }

    #[inline]
    fn insert(&mut self, item: AgendaItem) {
        if item.at <= self.opened {
            let to_come = &self.batch[self.done..];
            let index = to_come.partition_point(|other| other.rank() < item.rank());
            self.batch.insert(self.done + index, item);
            return;
        }
        let recent = self.recent.iter().find(|(at, _)| *at == item.at);
        let bucket = match recent {
            Some((_, bucket)) => *bucket,
            None => self.bucket(item.at),
        };
        self.buckets[bucket].push(item);
    }

    /// Returns a new bucket for an instant.
    fn bucket(&mut self, at: Time) -> usize {
        let bucket = self.free.pop().unwrap_or_else(|| {
            self.buckets.push(Vec::new());
            self.buckets.len() - 1
        });
        let instant = Reverse(InstantKey::new(at, bucket));
        if !std::mem::take(&mut self.is_first_over) {
            self.instants.push(instant);
        } else if let Some(mut first) = self.instants.peek_mut() {
            *first = instant;
        }
        self.recent[self.oldest] = (at, bucket);
        self.oldest = (self.oldest + 1) % RECENT;
        bucket
    }

    /// Returns the run time of the first event; [`Time::MAX`] without one.
    #[inline]
    pub(super) fn next_at(&self) -> Time {
        match self.batch.get(self.done) {
            Some(first) => first.at,
            None => self.first().map_or(Time::MAX, InstantKey::at),
        }
    }

    /// Returns the first instant after the one that came.
    #[inline]
    fn first(&self) -> Option<InstantKey> {
        let instants = self.instants.as_slice();
        let first = if self.is_first_over {
            // The slice is a binary heap, the greatest first: the next is one of its children.
            instants.get(1).max(instants.get(2))
        } else {
            instants.first()
        };
        first.map(|first| first.0)
    }

    /// Removes the first event.
    #[inline]
    pub(super) fn pop(&mut self) -> Option<AgendaItem> {
        if self.done == self.batch.len() {
            self.open();
        }
        let first = *self.batch.get(self.done)?;
        self.done += 1;
        Some(first)
    }

    /// Puts the events of the next instant in order.
    fn open(&mut self) {
        self.batch.clear();
        self.done = 0;
        let Some(first) = self.first() else {
            return;
        };
        self.opened = first.at();
        while let Some(next) = self.first()
            && next.at() == self.opened
        {
            if std::mem::replace(&mut self.is_first_over, true) {
                self.instants.pop();
            }
            let bucket = next.bucket();
            if self.batch.is_empty() {
                std::mem::swap(&mut self.batch, &mut self.buckets[bucket]);
            } else {
                self.batch.append(&mut self.buckets[bucket]);
            }
            self.free.push(bucket);
        }
        self.batch.sort_unstable_by_key(AgendaItem::rank);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Some instants: few, so that many events are due together.
    fn times() -> impl Strategy<Value = Time> {
        (0..12_u64).prop_map(Time::from_nanos)
    }

    #[derive(Clone, Debug)]
    enum Step {
        Alarm(Time, Phase, u32, usize),
        Arrival(Time, usize),
        Pop,
    }

    fn steps() -> impl Strategy<Value = Vec<Step>> {
        let phase = prop_oneof![Just(Phase::End), Just(Phase::Timer), Just(Phase::Start)];
        let alarm = (times(), phase, 0..3_u32, 0..4_usize);
        let step = prop_oneof![
            3 => alarm.prop_map(|(at, phase, priority, node)| Step::Alarm(at, phase, priority, node)),
            2 => (times(), 0..4_usize).prop_map(|(at, node)| Step::Arrival(at, node)),
            3 => Just(Step::Pop),
        ];
        proptest::collection::vec(step, 0..120)
    }

    proptest! {
        #[test]
        fn events_come_by_time_then_phase_then_rank(steps in steps()) {
            let (mut agenda, mut model) = (Agenda::default(), Vec::new());
            let (mut now, mut arrivals) = (Time::ZERO, 0);
            for step in steps {
                match step {
                    Step::Alarm(at, phase, priority, node) => {
                        agenda.add(at, phase, (priority, node), node);
                        let rank = u64::from(priority) << 32 | node as u64;
                        model.push((at.max(now), phase as u64, rank, node));
                    }
                    // A message is never delivered in the past.
                    Step::Arrival(at, node) => {
                        arrivals += 1;
                        agenda.add_arrival(at.max(now), node, 0);
                        model.push((at.max(now), Phase::ARRIVE, arrivals, node));
                    }
                    Step::Pop => {
                        model.sort_unstable();
                        let first = (!model.is_empty()).then(|| model.remove(0));
                        prop_assert_eq!(agenda.next_at(), first.map_or(Time::MAX, |first| first.0));
                        let item = agenda.pop();
                        let popped = item.map(|item| (item.at, item.node as usize));
                        prop_assert_eq!(popped, first.map(|first| (first.0, first.3)));
                        now = first.map_or(now, |first| first.0);
                    }
                }
            }
        }
    }
}
