//! The parts of an age.

use std::time::Duration;

use ratelab::{Head, MessageId, Time, Topology};
use smallvec::SmallVec;

use super::{
    DataWay, Lineage, TracedTick,
    causes::{Step, begin_of},
};

/// Maximum number of messages in a chain.
pub(super) const MOST_HOPS: usize = 64;

/// The title of a stage that ends with a newer message.
const HOLD: &str = "in use until a newer message on";

/// A stage of an age, with the index of the node or topic that it is due to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum AgeStage {
    /// Before the first known tick: the error of a clock, or an unrecorded part of the chain.
    Before,
    /// From the arrival of a message to the next tick of the node that reads it.
    Wait(usize),
    /// From the arrival of a message to that of the message that completes its set.
    Match {
        /// The topic of the other message.
        topic: usize,
        /// The reader.
        node: usize,
    },
    /// From the release of a tick of a node to its start, while the executor was busy.
    Executor(usize),
    /// Behind older messages of a topic, in a queue with read order oldest.
    Queue(usize),
    /// From the first read of a message of a topic to its latest one, without a newer message.
    Reuse(usize),
    /// In a tick of a node with a duration.
    Cost(usize),
    /// On the link of a topic.
    Link(usize),
    /// In force, without a newer message of the topic.
    Held(usize),
    /// In force while a newer message waited for the node that acts.
    Kept(usize),
}

impl AgeStage {
    /// Returns the name of the node or topic that it is due to; empty for what is before the first
    /// known tick.
    pub fn owner(self, topology: &Topology) -> &str {
        let place = self.place();
        match self {
            Self::Before => "",
            Self::Wait(_) | Self::Kept(_) | Self::Executor(_) | Self::Cost(_) => {
                &topology.nodes[place].name
            }
            _ => &topology.topics[place].name,
        }
    }

    /// Returns the index of that node or topic.
    pub fn place(self) -> usize {
        match self {
            Self::Before => usize::MAX,
            Self::Wait(place)
            | Self::Executor(place)
            | Self::Queue(place)
            | Self::Reuse(place)
            | Self::Cost(place)
            | Self::Link(place)
            | Self::Held(place)
            | Self::Kept(place)
            | Self::Match { topic: place, .. } => place,
        }
    }

    /// Returns its name in JSON and tables.
    pub fn key(self) -> &'static str {
        self.names().key
    }

    /// Returns its name in a report, to be followed by its owner.
    pub fn title(self) -> &'static str {
        self.names().title
    }

    /// Returns what the data did meanwhile, in a word: of several stages the same.
    pub fn word(self) -> &'static str {
        self.names().word
    }

    /// Returns its description with `{}` for the owner, to follow a number of milliseconds.
    pub fn phrase(self) -> &'static str {
        self.names().phrase
    }

    fn names(self) -> StageNames {
        let names = |key, title, word, phrase| StageNames {
            key,
            title,
            word,
            phrase,
        };
        match self {
            Self::Before => names(
                "before",
                "before what is known",
                "unknown",
                "before the first tick",
            ),
            Self::Wait(_) => names("wait", "waiting for", "waited", "waiting for the {}"),
            Self::Match { .. } => names(
                "match",
                "waiting for a match on",
                "waited",
                "waiting for {} to match",
            ),
            Self::Executor(_) => names(
                "executor",
                "waiting for the executor of",
                "waited",
                "waiting for the executor of the {}",
            ),
            Self::Queue(_) => names("queue", "in the queue of", "waited", "in the queue of {}"),
            Self::Reuse(_) => names("hold", HOLD, "waited", "reusing {}"),
            Self::Cost(_) => names("cost", "in", "worked", "in the {}"),
            Self::Link(_) => names("link", "on", "on links", "on {}"),
            Self::Held(_) => names("hold", HOLD, "held", "held"),
            Self::Kept(_) => names("wait", "waiting for", "held", "held"),
        }
    }
}

/// What a stage is called; two stages that one thing ends have one key.
struct StageNames {
    key: &'static str,
    title: &'static str,
    word: &'static str,
    /// With `{}` for the owner.
    phrase: &'static str,
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
    /// Returns the age (ns); negative after a clock error.
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

/// Returns the duration in nanoseconds, signed like an age; longer than any run on overflow.
pub fn nanos(duration: Duration) -> i64 {
    i64::try_from(duration.as_nanos()).unwrap_or(i64::MAX)
}

impl Lineage {
    /// Returns the parts of the age of a message at its delivery, from the sensing on; of its data
    /// from the node `source` where no path tells the way. `None` where not all of its chain is
    /// known.
    pub(super) fn parts_at_arrival(
        &self,
        message: MessageId,
        source: Option<usize>,
    ) -> Option<AgeParts> {
        let steps = self.steps(message, source).take(MOST_HOPS + 1);
        let steps: SmallVec<[Step<'_>; 4]> = steps.collect();
        if steps.len() > MOST_HOPS {
            return None;
        }
        let mut parts = AgeParts {
            parts: Vec::with_capacity(4 * steps.len()),
            before_ns: 0,
        };
        let mut read: Option<(MessageId, &Head)> = None;
        for Step {
            message,
            sent,
            made,
        } in steps.iter().rev()
        {
            let (message, sent) = (*message, (*sent)?);
            match (*made, read) {
                (Some((node, index, worked)), Some(read)) => {
                    self.add_reading(&mut parts, read, node, index);
                    parts.add(AgeStage::Cost(node), works_from(read.1, worked), sent.at);
                }
                (Some((node, _, worked)), None) if self.may_begin(message, node, source) => {
                    parts.add(AgeStage::Cost(node), begin_of(sent, worked), sent.at);
                }
                (None, None) if sent.by.is_none() => {
                    parts.before_ns = signed(sent.at) - signed(sent.sensed());
                }
                // No data of this chain came with it yet, or what is known of the run begins later.
                _ => return None,
            }
            parts.add(AgeStage::Link(message.topic), sent.at, sent.arrives?);
            read = Some((message, sent));
        }
        Some(parts)
    }

    /// Returns whether data may begin with a message that this node published.
    fn may_begin(&self, message: MessageId, node: usize, source: Option<usize>) -> bool {
        match &self.way {
            DataWay::Along(path) => path.first() == Some(&message.topic),
            DataWay::FromSource(_) => source == Some(node),
        }
    }

    /// Adds the parts from the delivery of a message to the tick with this `index` of a
    /// node that read it.
    pub(super) fn add_reading(
        &self,
        parts: &mut AgeParts,
        (message, sent): (MessageId, &Head),
        node: usize,
        index: usize,
    ) {
        let MessageId { topic, .. } = message;
        let (ticks, arrives) = (&self.nodes[node].ticks, sent.arrives.unwrap_or_default());
        let at = |index: usize| ticks[index].tick.at;
        let first_read = self.first_read(message, node, index);
        let (missing, could, ready) = match self.waited_for(node, first_read, topic) {
            Some(other) => {
                let missing = AgeStage::Match { topic: other, node };
                (missing, first_read, ticks[first_read].tick.due())
            }
            None => {
                let could = self.first_chance(message, node, first_read);
                let missing = AgeStage::Wait(node);
                (missing, could, self.released(node, could))
            }
        };
        let begins = at(could).max(arrives);
        let ready = ready.clamp(arrives, begins);
        let late = match self.topology.nodes[node].executor {
            Some(_) => AgeStage::Executor(node),
            None => AgeStage::Wait(node),
        };
        parts.add(missing, arrives, ready);
        parts.add(late, ready, begins);
        parts.add(AgeStage::Queue(topic), begins, at(first_read));
        parts.add(AgeStage::Reuse(topic), at(first_read), at(index));
    }

    /// Returns the topic that a message of this `topic` waited for in the set of a tick: the one
    /// whose message completed the set; of messages that came at once another one. `None` for a
    /// node that does not tick on sets.
    pub(super) fn waited_for(&self, node: usize, index: usize, topic: usize) -> Option<usize> {
        let triggers = &self.topology.nodes[node].triggers;
        let worked = &self.nodes[node].ticks[index];
        let tick = &worked.tick;
        let meets = triggers.len() > 1 && triggers.contains(&topic);
        let completed = tick.causes.completed.filter(|_| meets)?;
        let last = |read: &MessageId| {
            let arrives = self.head(*read).and_then(|sent| sent.arrives);
            triggers.contains(&read.topic) && arrives == Some(tick.due())
        };
        Some(
            worked
                .reads()
                .filter(|read| read.topic != topic)
                .find(last)
                .filter(|_| completed == topic)
                .map_or(completed, |read| read.topic),
        )
    }

    /// Returns the release of a tick: before its start where the node has an executor.
    pub(super) fn released(&self, node: usize, index: usize) -> Time {
        let tick = &self.nodes[node].ticks[index].tick;
        match self.topology.nodes[node].executor {
            Some(_) => tick.due(),
            None => tick.at,
        }
    }

    /// Returns the first tick of a node in the unbroken series of reads of this message that ends
    /// with the tick `index`.
    pub(super) fn first_read(&self, message: MessageId, node: usize, index: usize) -> usize {
        let ticks = &self.nodes[node].ticks;
        let again = |index: &usize| ticks[*index].read_of(message.topic) == Some(message);
        index - (0..index).rev().take_while(again).count()
    }

    /// Returns the first tick of a node that could have read a message, but read an older one of
    /// its queue, up to the one that read it first.
    fn first_chance(&self, message: MessageId, node: usize, first_read: usize) -> usize {
        let ticks = &self.nodes[node].ticks;
        let found = |index: &usize| {
            ticks[*index].tick.causes.reads.iter().any(|read| {
                let is_older = read.message.seq < message.seq && read.newest >= message.seq;
                read.message.topic == message.topic && is_older
            })
        };
        first_read - (0..first_read).rev().take_while(found).count()
    }
}

/// Returns from when on a tick works on a message: its start, or the delivery of one that it reads
/// later.
pub(super) fn works_from(sent: &Head, worked: &TracedTick) -> Time {
    worked.tick.at.max(sent.arrives.unwrap_or_default())
}

pub(super) fn signed(time: Time) -> i64 {
    i64::try_from(time.as_nanos()).unwrap_or(i64::MAX)
}
