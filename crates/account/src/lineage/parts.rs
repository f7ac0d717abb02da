//! The parts of an age.

use std::time::Duration;

use ratelab::{Time, Topology};

use super::{Lineage, sensing_of};

/// Maximum number of messages in a chain.
pub(super) const MOST_HOPS: usize = 64;

/// A stage of an age. Nodes and topics are indices into the topology.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum AgeStage {
    /// Before the first known tick: the error of a clock, or an unrecorded part of the chain.
    Before,
    /// From the arrival of a message to the next tick of the node that reads it.
    Wait {
        /// The topic.
        topic: usize,
        /// The reader.
        node: usize,
    },
    /// From the arrival of a message to that of the message that completes its set.
    Match {
        /// The topic of the other message.
        topic: usize,
        /// The reader.
        node: usize,
    },
    /// From the release of a tick to its start, while the executor was busy.
    Executor {
        /// The node.
        node: usize,
    },
    /// Behind older messages, in a queue with read order oldest.
    Queue {
        /// The topic.
        topic: usize,
        /// The reader.
        node: usize,
    },
    /// From the first read of a message to its latest one, without a newer message.
    Reuse {
        /// The topic.
        topic: usize,
        /// The reader.
        node: usize,
    },
    /// In a tick with a duration.
    Cost {
        /// The node.
        node: usize,
    },
    /// On the link of a topic.
    Link {
        /// The topic.
        topic: usize,
    },
    /// In force, without a newer message.
    Held {
        /// The topic.
        topic: usize,
        /// The node that acts.
        node: usize,
    },
    /// In force while a newer message waited for the node that acts.
    Kept {
        /// The topic.
        topic: usize,
        /// The node that acts.
        node: usize,
    },
}

impl AgeStage {
    /// The name of the node or topic that it is due to; empty for what is before the first known
    /// tick.
    pub fn owner(self, topology: &Topology) -> &str {
        match self {
            Self::Before => "",
            Self::Wait { node, .. }
            | Self::Kept { node, .. }
            | Self::Executor { node }
            | Self::Cost { node } => &topology.nodes[node].name,
            Self::Match { topic, .. }
            | Self::Queue { topic, .. }
            | Self::Reuse { topic, .. }
            | Self::Held { topic, .. }
            | Self::Link { topic } => &topology.topics[topic].name,
        }
    }
}

/// A part of an age.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AgePart {
    /// The stage.
    pub stage: AgeStage,
    /// The duration.
    pub took: Duration,
}

/// An age as a list of parts, whose sum is exact to the nanosecond.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AgeParts {
    /// From the sensing to now, without parts of length zero.
    pub parts: Vec<AgePart>,
    /// Time before the first known tick (ns): the error of the clock that stamped the
    /// sensing, or an unrecorded part of the chain.
    pub before_ns: i64,
}

impl AgeParts {
    /// The age (ns); negative after a clock error.
    pub fn sum_ns(&self) -> i64 {
        let parts = self.parts.iter().map(|part| nanos(part.took));
        self.before_ns + parts.sum::<i64>()
    }

    /// Adds a part after the others.
    pub(super) fn add(&mut self, stage: AgeStage, from: Time, to: Time) {
        let took = to.since(from);
        if !took.is_zero() {
            self.parts.push(AgePart { stage, took });
        }
    }
}

/// The duration in nanoseconds, signed like an age; longer than any run on overflow.
pub fn nanos(duration: Duration) -> i64 {
    i64::try_from(duration.as_nanos()).unwrap_or(i64::MAX)
}

impl Lineage {
    /// The parts of the age of message number `seq` of a topic at its delivery, from the
    /// sensing on.
    pub fn parts_at_arrival(&self, topic: usize, seq: u64) -> Option<AgeParts> {
        self.chain(topic, seq, MOST_HOPS)
    }

    /// The parts for a chain of at most `hops` messages.
    fn chain(&self, topic: usize, seq: u64, hops: usize) -> Option<AgeParts> {
        let sent = self.topics.get(topic)?.message(seq)?;
        let (node, index) = self.made_by(topic, seq)?;
        let began = self.nodes[node].ticks[index].tick.at;
        let mut parts = match self.behind((topic, seq), node, index) {
            Some((input, read)) => {
                let mut parts = self.chain(input, read, hops.checked_sub(1)?)?;
                self.add_reading(&mut parts, (input, read), node, index);
                parts
            }
            // No data of this chain came with it yet.
            None if self.path.iter().skip(1).any(|on_it| *on_it == topic) => return None,
            None => AgeParts {
                parts: Vec::new(),
                before_ns: match self.path.first() == Some(&topic) {
                    true => 0, // Its data begin with the tick.
                    false => signed(began) - signed(sensing_of(sent)),
                },
            },
        };
        parts.add(AgeStage::Cost { node }, began, sent.at);
        parts.add(AgeStage::Link { topic }, sent.at, sent.arrives?);
        Some(parts)
    }

    /// The message that the data of another one, made by this tick, came with; `None` if they
    /// begin with the tick.
    pub(super) fn behind(
        &self,
        (topic, seq): (usize, u64),
        node: usize,
        index: usize,
    ) -> Option<(usize, u64)> {
        if let Some(place) = self.path.iter().position(|on_it| *on_it == topic) {
            let before = *self.path.get(place.checked_sub(1)?)?;
            let read = self.nodes[node].ticks[index].read(before)?;
            return Some((before, read));
        }
        let sent = self.topics[topic].message(seq)?;
        self.derived_from(node, index, sensing_of(sent))
            .filter(|_| sent.origin.is_some())
    }

    /// The tick that made message number `seq` of a topic, as a node and the index of a
    /// tick.
    pub fn made_by(&self, topic: usize, seq: u64) -> Option<(usize, usize)> {
        let sent = self.topics.get(topic)?.message(seq)?;
        let publishers = self.topology.topics[topic].publishers.iter();
        let ticks = publishers.filter_map(|&node| {
            let ticks = &self.nodes[node].ticks;
            let last = ticks.partition_point(|worked| worked.tick.at <= sent.at);
            // A tick that begins at the end of another one has published nothing yet.
            let recent = (last.saturating_sub(2)..last).rev();
            let made = recent
                .clone()
                .filter(|index| ticks[*index].ends() == sent.at);
            let knows = |index: &usize| {
                sent.origin.is_none() || self.derived_from(node, *index, sensing_of(sent)).is_some()
            };
            // A node that senses reads nothing: its tick began with the sensing.
            let senses = |index: &usize| ticks[*index].tick.at == sensing_of(sent);
            let known = made.clone().find(knows);
            let made = known.or(made.clone().find(senses)).or(made.clone().next());
            Some((node, made.or(last.checked_sub(1))?, made.is_some()))
        });
        let ticks: Vec<_> = ticks.collect();
        let exact = ticks.iter().find(|(.., exact)| *exact);
        let (node, index, _) = exact.or(ticks.first())?;
        Some((*node, *index))
    }

    /// The messages published by the tick with this index of a node, as topics and
    /// sequence numbers.
    pub fn made(&self, node: usize, index: usize) -> Vec<(usize, u64)> {
        let Some(worked) = self.nodes[node].ticks.get(index) else {
            return Vec::new();
        };
        let topics = self.topology.topics.iter().enumerate();
        let outputs = topics.filter(|(_, topic)| topic.publishers.contains(&node));
        let made = outputs.flat_map(|(topic, _)| {
            let sent = &self.topics[topic].sent;
            let first = sent.partition_point(|sent| sent.at < worked.ends());
            let last = sent.partition_point(|sent| sent.at <= worked.ends());
            let seqs = sent.range(first..last).map(|sent| sent.seq);
            seqs.map(move |seq| (topic, seq))
        });
        made.filter(|(topic, seq)| self.made_by(*topic, *seq) == Some((node, index)))
            .collect()
    }

    /// The message with the sensing `sensed` that a tick read.
    pub fn derived_from(&self, node: usize, index: usize, sensed: Time) -> Option<(usize, u64)> {
        let reads = self.nodes[node].ticks[index].reads.iter();
        let known = reads.copied().find(|&(topic, seq)| {
            let read = self.topics[topic].message(seq);
            read.is_some_and(|read| sensing_of(read) == sensed)
        });
        known.or_else(|| self.arrived_with(node, index, sensed))
    }

    /// The message with the sensing `sensed` that a tick read under the real clock, where the time of
    /// a read is less exact than that of its tick.
    fn arrived_with(&self, node: usize, index: usize, sensed: Time) -> Option<(usize, u64)> {
        let at = self.nodes[node].ticks[index].tick.at;
        self.nodes[node].inputs.iter().find_map(|&topic| {
            let recent = self.topics[topic].after(None, at).rev().take(16);
            let mut known = recent.filter(|sent| sent.arrives.is_some_and(|by| by <= at));
            let read = known.find(|sent| sensing_of(sent) == sensed)?;
            Some((topic, read.seq))
        })
    }

    /// Adds the parts from the delivery of a message to the tick with this `index` of a
    /// node that read it.
    pub(super) fn add_reading(
        &self,
        parts: &mut AgeParts,
        (topic, seq): (usize, u64),
        node: usize,
        index: usize,
    ) {
        let Some(sent) = self.topics[topic].message(seq) else {
            return;
        };
        let (ticks, arrives) = (&self.nodes[node].ticks, sent.arrives.unwrap_or_default());
        let at = |index: usize| ticks[index].tick.at;
        let first_read = self.first_read((topic, seq), node, index);
        let (could, missing, ready) = if self.meets(node, topic) {
            let other = self.waited_for(node, first_read, topic);
            let missing = AgeStage::Match { topic: other, node };
            (first_read, missing, ticks[first_read].tick.due())
        } else {
            let first = ticks.partition_point(|worked| worked.tick.at < arrives);
            let mut seen =
                (first..first_read).filter(|&index| self.is_seen(topic, sent, node, at(index)));
            let could = seen.next().unwrap_or(first_read);
            let missing = AgeStage::Wait { topic, node };
            (could, missing, self.released(node, could))
        };
        let begins = at(could).max(arrives);
        let ready = ready.clamp(arrives, begins);
        let late = match self.topology.nodes[node].executor {
            Some(_) => AgeStage::Executor { node },
            None => AgeStage::Wait { topic, node },
        };
        parts.add(missing, arrives, ready);
        parts.add(late, ready, begins);
        parts.add(AgeStage::Queue { topic, node }, at(could), at(first_read));
        parts.add(AgeStage::Reuse { topic, node }, at(first_read), at(index));
    }

    /// The release of a tick: before its start where the node has an executor.
    pub(super) fn released(&self, node: usize, index: usize) -> Time {
        let tick = &self.nodes[node].ticks[index].tick;
        match self.topology.nodes[node].executor {
            Some(_) => tick.due(),
            None => tick.at,
        }
    }

    /// The first tick of a node in the unbroken series of reads of this message that ends
    /// with the tick `index`.
    pub(super) fn first_read(
        &self,
        (topic, seq): (usize, u64),
        node: usize,
        index: usize,
    ) -> usize {
        let ticks = &self.nodes[node].ticks;
        // What a tick applied is known better than what it read.
        let applied_another = |index| {
            let applied = self.applied_by(node, index);
            applied.is_some_and(|(of, other)| of == topic && other != seq)
        };
        let again =
            |index: &usize| ticks[*index].read(topic) == Some(seq) && !applied_another(*index);
        index - (0..index).rev().take_while(again).count()
    }
}

pub(super) fn signed(time: Time) -> i64 {
    i64::try_from(time.as_nanos()).unwrap_or(i64::MAX)
}
