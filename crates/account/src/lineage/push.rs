//! The action in force, and the parts of its age.

use std::{iter, mem, time::Duration};

use ratelab::Time;

use super::{
    Lineage, TracedTick,
    parts::{AgeParts, AgeStage, MOST_HOPS, signed},
};

/// An action in force for a stretch of run time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PushInForce {
    /// The topic of the applied action.
    pub topic: usize,
    /// Sequence number of the message.
    pub seq: u64,
    /// The node that applies it.
    pub node: usize,
    /// Run time of its first application.
    pub since: Time,
    /// Run time of the delivery of a newer message.
    pub outdated: Option<Time>,
    /// The parts of its age at its first application.
    parts: AgeParts,
}

impl PushInForce {
    /// The parts of its age at run time `at`.
    pub fn parts(&self, at: Time) -> AgeParts {
        let (topic, node) = (self.topic, self.node);
        let outdated = self
            .outdated
            .unwrap_or(at)
            .clamp(self.since, at.max(self.since));
        let mut parts = self.parts.clone();
        parts.add(AgeStage::Held { topic, node }, self.since, outdated);
        parts.add(AgeStage::Kept { topic, node }, outdated, at);
        parts
    }
}

impl Lineage {
    /// The push of the node with index `node` in force at run time `at`; `None` before
    /// the first push, and where its chain is unknown.
    pub fn push_at(&self, node: usize, at: Time) -> Option<PushInForce> {
        let ticks = &self.nodes.get(node)?.ticks;
        let last = ticks.partition_point(|worked| worked.ends() <= at);
        self.push_of(node, last.checked_sub(1)?)
    }

    /// The push applied by the tick with this index, for the first time or again.
    pub(super) fn push_of(&self, node: usize, index: usize) -> Option<PushInForce> {
        let ticks = &self.nodes[node].ticks;
        let (topic, seq) = self.applied_by(node, index)?;
        let first = self.first_read((topic, seq), node, index);
        let mut parts = self.parts_at_arrival(topic, seq)?;
        self.add_reading(&mut parts, (topic, seq), node, first);
        let TracedTick { tick, .. } = &ticks[first];
        let since = tick.ends?;
        parts.add(AgeStage::Cost { node }, tick.at, since);
        // That of another chain through the node is not measured by its pushes.
        if let Some(push) = ticks[index].tick.push.filter(|_| !self.beside) {
            // What is recorded of the chain may begin later.
            parts.before_ns += signed(since) - signed(push.sensed) - parts.sum_ns();
        }
        let newer = self.topics[topic].after(Some(seq), Time::MAX).take(64);
        Some(PushInForce {
            topic,
            seq,
            node,
            since,
            outdated: newer.filter_map(|sent| sent.arrives).min(),
            parts,
        })
    }

    /// The message that a tick of an acting node applied.
    pub(super) fn applied_by(&self, node: usize, index: usize) -> Option<(usize, u64)> {
        let worked = &self.nodes[node].ticks[index];
        if let Some(topic) = self.path.last() {
            return Some((*topic, worked.read(*topic)?));
        }
        let sensed = worked.tick.push.map(|push| push.sensed);
        let known = || self.derived_from(node, index, sensed?);
        known().or(worked.reads.first().copied())
    }

    /// All pushes of a node with known chains, oldest first.
    pub fn pushes(&self, node: usize) -> Vec<PushInForce> {
        let mut pushes: Vec<PushInForce> = Vec::new();
        for index in 0..self.nodes[node].ticks.len() {
            let read = self.applied_by(node, index);
            let again = pushes.last().map(|push| (push.topic, push.seq));
            if read != again {
                pushes.extend(self.push_of(node, index));
            }
        }
        pushes
    }

    /// Run time of a node's first known push; zero if there is none.
    pub fn first_push(&self, node: usize) -> Time {
        let ticks = self.nodes[node].ticks.iter();
        let mut pushes = ticks.filter(|worked| !worked.reads.is_empty());
        pushes
            .next()
            .and_then(|worked| worked.tick.ends)
            .unwrap_or_default()
    }

    /// The pushes of a node in force between two run times, newest first, each with the end of
    /// that; up to one whose chain is unknown.
    pub fn pushes_between(
        &self,
        node: usize,
        from: Time,
        to: Time,
    ) -> impl Iterator<Item = (PushInForce, Time)> {
        let mut end = to;
        iter::from_fn(move || {
            let before = (end > from).then(|| end - Time::RESOLUTION)?;
            let push = self.push_at(node, before)?;
            let until = mem::replace(&mut end, push.since);
            Some((push, until))
        })
    }

    /// The greatest push age of a node over run time `from` to `to`.
    pub fn greatest_age(&self, node: usize, from: Time, to: Time) -> Duration {
        let pushes = self.pushes_between(node, from, to);
        let greatest = pushes.map(|(push, end)| push.parts(end).sum_ns()).max();
        let greatest = u64::try_from(greatest.unwrap_or_default());
        Duration::from_nanos(greatest.unwrap_or_default())
    }
}

/// The ticks and messages behind a push.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Chain {
    /// Nodes and indices of their ticks, the acting node first.
    pub ticks: Vec<(usize, usize)>,
    /// Topics and sequence numbers, the applied message first.
    pub messages: Vec<(usize, u64)>,
}

impl Lineage {
    /// The chain behind `push`, back to the sensing.
    pub fn chain_of(&self, push: &PushInForce) -> Chain {
        let mut chain = Chain::default();
        let ticks = &self.nodes[push.node].ticks;
        let acts = ticks.partition_point(|worked| worked.ends() < push.since);
        chain.ticks.push((push.node, acts));
        let mut next = Some((push.topic, push.seq));
        while let Some((topic, seq)) = next.filter(|_| chain.messages.len() < MOST_HOPS) {
            chain.messages.push((topic, seq));
            let made = self.made_by(topic, seq);
            chain.ticks.extend(made);
            next = made.and_then(|(node, index)| self.behind((topic, seq), node, index));
        }
        chain
    }
}
