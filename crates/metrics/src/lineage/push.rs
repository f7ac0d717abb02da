//! The action in force, and the parts of its age.

use std::{iter, mem, time::Duration};

use ratelab::{MessageId, Time, TimeSpan};

use super::{
    DataWay, Lineage, TickPlace, TracedTick,
    parts::{AgeParts, AgeStage, MOST_HOPS, signed, works_from},
};

/// An action in force for a stretch of run time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PushInForce {
    /// The message with the applied action.
    pub message: MessageId,
    /// The node that applies it.
    pub node: usize,
    /// Run time of its first application.
    pub since: Time,
    /// Run time of the delivery of a newer message.
    pub outdated: Option<Time>,
    /// For a node that ticks on sets: the topic that the newer message waited for, and the run time at
    /// which its set was complete.
    matched: Option<(usize, Time)>,
    /// The node that began the data, where no path tells the way.
    source: Option<usize>,
    /// The parts of its age at its first application.
    parts: AgeParts,
}

impl PushInForce {
    /// Returns the parts of its age at run time `at`.
    pub fn parts(&self, at: Time) -> AgeParts {
        let mut parts = self.parts.clone();
        for (stage, from, to) in self.growing() {
            parts.add(stage, from, at.min(to));
        }
        parts
    }

    /// Returns the parts of its age at its first application.
    pub fn applied(&self) -> &AgeParts {
        &self.parts
    }

    /// Returns what its age grows by after that, with the run times between which each part grows:
    /// held, waiting for a match, and for the node. [`Time::MAX`] for never.
    pub fn growing(&self) -> [(AgeStage, Time, Time); 3] {
        let (node, topic) = (self.node, self.message.topic);
        let outdated = self.outdated.unwrap_or(Time::MAX).max(self.since);
        let (other, complete) = self.matched.unwrap_or((topic, outdated));
        let complete = complete.max(outdated);
        [
            (AgeStage::Held(topic), self.since, outdated),
            (AgeStage::Match { topic: other, node }, outdated, complete),
            (AgeStage::Kept(node), complete, Time::MAX),
        ]
    }
}

impl Lineage {
    /// Returns the push of the node with index `node` in force at run time `at`; `None` before
    /// the first push, and where its chain is unknown.
    pub fn push_at(&self, node: usize, at: Time) -> Option<PushInForce> {
        let ticks = &self.nodes.get(node)?.ticks;
        let ended = ticks.partition_point(|worked| worked.ends() <= at);
        let last = (0..ended).rev().find(|index| self.acts(node, *index))?;
        self.push_of(node, last)
    }

    /// Returns whether a tick acts: one of a node whose actions are recorded has one. The end of
    /// another chain acts in each tick.
    fn acts(&self, node: usize, index: usize) -> bool {
        let known = &self.nodes[node];
        let is_chain = self.beside && matches!(self.way, DataWay::Along(_));
        is_chain || !known.acts || known.ticks[index].tick.push.is_some()
    }

    /// Returns the push applied by the tick with this index, for the first time or again.
    pub(super) fn push_of(&self, node: usize, index: usize) -> Option<PushInForce> {
        let ticks = &self.nodes[node].ticks;
        let (message, source) = self.applied_by(node, index)?;
        let mut series = self.first_read(message, node, index)..=index;
        let first = series.find(|index| self.acts(node, *index))?;
        let mut parts = self.parts_at_arrival(message, source)?;
        let sent = self.head(message)?;
        self.add_reading(&mut parts, (message, sent), node, first);
        let TracedTick { tick, .. } = &ticks[first];
        let since = tick.ends?;
        let began = works_from(sent, &ticks[first]);
        parts.add(AgeStage::Cost(node), began, since);
        // That of another chain through the node is not measured by its pushes.
        if let Some(push) = ticks[index].tick.push.filter(|_| !self.beside) {
            // What is recorded of the chain may begin later.
            parts.before_ns += signed(since) - signed(push.sensed) - parts.sum_ns();
        }
        let mut outdated: Option<Time> = None;
        for newer in self.topics[message.topic].after(message.seq).take(64) {
            // What is published after the delivery of another one does not come before it.
            if outdated.is_some_and(|first| first <= newer.at) {
                break;
            }
            outdated = outdated.into_iter().chain(newer.arrives).min();
        }
        Some(PushInForce {
            message,
            node,
            since,
            outdated,
            matched: self.next_match(message, node, index),
            source,
            parts,
        })
    }

    /// Returns what the set after that with a message waits for, and until when.
    fn next_match(&self, message: MessageId, node: usize, index: usize) -> Option<(usize, Time)> {
        let MessageId { topic, .. } = message;
        let ticks = &self.nodes[node].ticks;
        let mut later = (index + 1)..ticks.len();
        let next = later.find(|later| ticks[*later].read_of(topic) != Some(message));
        let other = self.waited_for(node, next.unwrap_or(index), topic)?;
        if let Some(next) = next {
            return Some((other, ticks[next].tick.due()));
        }
        // Not until now.
        let triggers = self.topology.nodes[node].triggers.iter();
        let mut others = [other].into_iter().chain(triggers.copied());
        Some((others.find(|other| *other != topic)?, Time::MAX))
    }

    /// Returns all pushes of a node with known chains, oldest first.
    pub fn pushes(&self, node: usize) -> Vec<PushInForce> {
        let mut pushes: Vec<PushInForce> = Vec::new();
        let ticks = 0..self.nodes[node].ticks.len();
        for index in ticks.filter(|index| self.acts(node, *index)) {
            let applied = self.applied_by(node, index);
            let again = pushes.last().map(|push| push.message);
            if applied.map(|(message, _)| message) != again {
                pushes.extend(self.push_of(node, index));
            }
        }
        pushes
    }

    /// Returns the run time of a node's first known push; zero if there is none.
    pub fn first_push(&self, node: usize) -> Time {
        let first = self.nodes[node]
            .ticks
            .iter()
            .find(|worked| !worked.reads.is_empty());
        first.and_then(|first| first.tick.ends).unwrap_or_default()
    }

    /// Returns the pushes of a node in force within a stretch of run time, newest first, each with
    /// the end of that; up to one whose chain is unknown.
    pub fn pushes_within(
        &self,
        node: usize,
        span: TimeSpan,
    ) -> impl Iterator<Item = (PushInForce, Time)> {
        let ticks = self.nodes.get(node).map(|node| &node.ticks);
        let mut ended = ticks.map_or(0, |ticks| {
            ticks.partition_point(|known| known.ends() < span.to)
        });
        let mut end = span.to;
        iter::from_fn(move || {
            let is_over = |place: &usize| {
                let known = ticks.is_some_and(|ticks| ticks[*place].ends() < end);
                known && self.acts(node, *place)
            };
            ended = (0..ended).rev().find(is_over).filter(|_| end > span.from)? + 1;
            let push = self.push_of(node, ended - 1)?;
            let until = mem::replace(&mut end, push.since);
            Some((push, until))
        })
    }

    /// Returns the greatest push age of a node within a stretch of run time.
    pub fn greatest_age(&self, node: usize, span: TimeSpan) -> Duration {
        let pushes = self.pushes_within(node, span);
        let greatest = pushes.map(|(push, end)| push.parts(end).sum_ns()).max();
        let greatest = u64::try_from(greatest.unwrap_or_default());
        Duration::from_nanos(greatest.unwrap_or_default())
    }
}

/// The ticks and messages behind a push.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Chain {
    /// The ticks, that of the acting node first.
    pub ticks: Vec<TickPlace>,
    /// The messages, the applied one first.
    pub messages: Vec<MessageId>,
}

impl Lineage {
    /// Returns the chain behind `push`, back to the sensing.
    pub fn chain_of(&self, push: &PushInForce) -> Chain {
        let mut chain = Chain::default();
        let ticks = &self.nodes[push.node].ticks;
        let acts = ticks.partition_point(|worked| worked.ends() < push.since);
        chain.ticks.push(TickPlace {
            node: push.node,
            index: acts,
        });
        for step in self.steps(push.message, push.source).take(MOST_HOPS) {
            chain.messages.push(step.message);
            chain
                .ticks
                .extend(step.made.map(|(node, index, _)| TickPlace { node, index }));
        }
        chain
    }
}
