//! The owner of each part of an age, and so the knob that cures it.

use std::{ops::Range, time::Duration};

use ratelab::{Head, Knob, KnobKind, Time, TimedKnob};
use ratelab_metrics::{AgeStage, NodeAccount, TracedTick, mean_parts};
use ratelab_system::Setup;

use super::{AgeOwner, Facts};
use crate::millis::mean;

impl Facts<'_> {
    /// Returns the owners of the push age of `node`, each with its mean part, the largest first.
    pub(super) fn owners(&self, node: usize) -> Vec<(AgeOwner, Duration)> {
        let mut owners: Vec<(AgeOwner, f64)> = Vec::new();
        for (stage, ns) in mean_parts(self.lineage, node, self.late) {
            let Some(owner) = self.owner(stage, ns) else {
                continue;
            };
            match owners.iter_mut().find(|(known, _)| *known == owner) {
                Some((_, sum)) => *sum += ns,
                None => owners.push((owner, ns)),
            }
        }
        owners.sort_by(|(_, one), (_, other)| other.total_cmp(one));
        let nanos = |ns: f64| Duration::from_nanos(ns as u64);
        owners
            .into_iter()
            .map(|(owner, ns)| (owner, nanos(ns)))
            .collect()
    }

    /// Returns the owner of a part; `None` where it is unknown.
    fn owner(&self, stage: AgeStage, ns: f64) -> Option<AgeOwner> {
        Some(match stage {
            AgeStage::Before => return None,
            AgeStage::Match { .. } | AgeStage::Link(_) | AgeStage::Queue(_) => {
                AgeOwner::Stage(stage)
            }
            AgeStage::Cost(node) => self.long(node),
            AgeStage::Executor(node) => self.late(node),
            AgeStage::Wait(node) | AgeStage::Kept(node) => self.slow(node, true),
            AgeStage::Reuse(topic) | AgeStage::Held(topic) => self.silent(topic, ns),
        })
    }

    /// Returns the owner of a mean gap of `ns` nanoseconds without a newer message on a topic.
    fn silent(&self, topic: usize, ns: f64) -> AgeOwner {
        let publishers = &self.graph.topics[topic].publishers;
        let Some(&node) = publishers.first() else {
            return AgeOwner::Stage(AgeStage::Link(topic));
        };
        let sent: Vec<&Head> = self.recent(topic).collect();
        let every = self.time().as_nanos() as f64 / sent.len().max(1) as f64;
        if self.graph.nodes[node].crashed {
            AgeOwner::Crash(node)
        } else if self.has_link(topic) && ns > every {
            AgeOwner::Stage(AgeStage::Link(topic))
        } else {
            self.slow(node, false)
        }
    }

    /// Returns the owner of the low tick rate of a node; `waiting` if a message is in its queue.
    fn slow(&self, node: usize, waiting: bool) -> AgeOwner {
        let view = &self.graph.nodes[node];
        let (busy, late) = (self.busy(node), self.lateness(node));
        let shifted = |knob: &&Knob| matches!(knob, Knob::Offset { .. });
        let wrong = |knob: &&Knob| matches!(knob, Knob::Clock { node, .. } if **node == *view.name);
        if view.crashed {
            AgeOwner::Crash(node)
        } else if busy * 2 > self.time() {
            self.long(node)
        } else if late * 2 > view.hz.period() {
            self.late(node)
        } else if self.setup.iter().any(|knob| wrong(&knob)) {
            AgeOwner::Clock(node)
        } else if let Some(knob) = self.setup.iter().find(shifted).filter(|_| waiting) {
            let named = |view: &NodeAccount| *knob.target() == *view.name;
            AgeOwner::Phase(self.graph.nodes.iter().position(named).unwrap_or(node))
        } else {
            AgeOwner::Rate(node)
        }
    }

    /// Returns the owner of the late ticks of a node.
    fn late(&self, node: usize) -> AgeOwner {
        match self.graph.nodes[node].executor {
            Some(_) => AgeOwner::Stage(AgeStage::Executor(node)),
            None => AgeOwner::Late(node),
        }
    }

    /// Returns the owner of the long ticks of a node.
    fn long(&self, node: usize) -> AgeOwner {
        match self.hang(node) {
            Some(hung) if hung * 2 > self.busy(node).min(self.time()) => AgeOwner::Hang(node),
            _ => AgeOwner::Stage(AgeStage::Cost(node)),
        }
    }

    /// Returns the duration of the longest recent hang of a node.
    pub(super) fn hang(&self, node: usize) -> Option<Duration> {
        let view = &self.graph.nodes[node];
        let recent = |hang: &&Hang| {
            let span = hang.span(view.hz.period());
            *hang.node == *view.name && span.start < self.late.to && self.late.from < span.end
        };
        self.hangs.iter().filter(recent).map(|hang| hang.cost).max()
    }

    /// Returns why nothing came through, from the sensing on: the nodes and topics of `path` that
    /// stand in the way.
    pub(super) fn unreached(&self, path: &[usize]) -> Vec<AgeOwner> {
        let nodes = path.iter().filter_map(|node| {
            let view = &self.graph.nodes[*node];
            match (view.crashed, view.busy) {
                (true, _) => Some(AgeOwner::Crash(*node)),
                (false, true) => Some(self.long(*node)),
                (false, false) => None,
            }
        });
        let topics = (0..self.graph.topics.len()).filter(|topic| {
            let view = &self.graph.topics[*topic];
            let of_path = view.publishers.iter().any(|node| path.contains(node));
            of_path && view.published > 0 && view.lost + view.in_flight() == view.published
        });
        nodes
            .chain(topics.map(|topic| AgeOwner::Stage(AgeStage::Link(topic))))
            .collect()
    }

    /// Returns how many of a topic's recent messages were lost on its link, and of how many.
    pub(super) fn lost(&self, topic: usize) -> (usize, usize) {
        let lost = self.recent(topic).filter(|sent| sent.arrives.is_none());
        (lost.count(), self.recent(topic).count())
    }

    /// Recent mean delay on the link of a topic.
    pub(super) fn delay(&self, topic: usize) -> Duration {
        let delays = self
            .recent(topic)
            .filter_map(|sent| Some(sent.arrives?.since(sent.at)));
        mean(delays).unwrap_or_default()
    }

    /// Returns whether the link of a topic recently delayed or lost a message.
    fn has_link(&self, topic: usize) -> bool {
        let mut sent = self.recent(topic);
        sent.any(|sent| sent.arrives != Some(sent.at))
    }

    /// Returns the recently published messages of a topic.
    fn recent(&self, topic: usize) -> impl Iterator<Item = &Head> {
        let recent = |sent: &&Head| sent.at > self.late.from;
        let sent = self.lineage.sent(topic).rev();
        sent.skip_while(|sent| sent.at > self.late.to)
            .take_while(recent)
    }

    /// Recent mean interval between the ticks of a node.
    pub(super) fn interval(&self, node: usize) -> Duration {
        let begun: Vec<Time> = self.ticks(node).map(|worked| worked.tick.at).collect();
        match (&begun[..], u32::try_from(begun.len().saturating_sub(1))) {
            ([newest, .., oldest], Ok(intervals)) => newest.since(*oldest) / intervals,
            _ => self.time(),
        }
    }

    /// Returns the period of a node, or the recent mean interval between its ticks if that is much
    /// longer, as just after a change of its rate.
    pub(super) fn pace(&self, node: usize) -> Duration {
        let (period, interval) = (self.graph.nodes[node].hz.period(), self.interval(node));
        if interval > period * 2 {
            interval
        } else {
            period
        }
    }

    /// Returns when the rate of a node was set, if that was within the stretch.
    pub(super) fn rate_changed(&self, node: usize) -> Option<Time> {
        let name = &*self.graph.nodes[node].name;
        let of_node =
            |timed: &&TimedKnob| timed.knob.kind() == KnobKind::Rate && timed.knob.target() == name;
        let last = self.commands.iter().rev().find(of_node);
        last.map(|timed| timed.at).filter(|at| *at > self.late.from)
    }

    /// Returns the recent ticks of a node.
    fn ticks(&self, node: usize) -> impl Iterator<Item = &TracedTick> {
        self.lineage
            .ticks(node)
            .rev()
            .skip_while(|worked| worked.tick.at > self.late.to)
            .take_while(|worked| worked.tick.at > self.late.from)
    }

    /// Recent time in ticks of a node. A tick in progress counts from one period after
    /// the end of the previous one. Under the real clock a tick may act at its start and
    /// be busy for longer.
    pub(super) fn busy(&self, node: usize) -> Duration {
        let ends = |worked: &TracedTick| {
            let tick = &worked.tick;
            let acted = tick.ends.unwrap_or(self.late.to);
            acted
                .max(tick.at + tick.took.unwrap_or_default())
                .min(self.late.to)
        };
        let ticks = self.ticks(node);
        let busy: Duration = ticks.map(|w| ends(w).since(w.tick.at)).sum();
        let last = self.ticks(node).next().map(ends);
        let now = self.graph.nodes[node].busy;
        let since = self.begun(node, last.unwrap_or(self.late.from));
        if now {
            busy + self.late.to.since(since)
        } else {
            busy
        }
    }

    /// Returns the start of the tick in progress of a node whose last one ended at `last`.
    fn begun(&self, node: usize, last: Time) -> Time {
        let view = &self.graph.nodes[node];
        if view.triggers.is_empty() {
            return last + view.hz.period();
        }
        // When the oldest message was there that its last tick left.
        let before = self.ticks(node).next();
        let waiting = view.triggers.iter().filter_map(|topic| {
            let read = before
                .into_iter()
                .flat_map(TracedTick::reads)
                .find(|read| read.topic == *topic)
                .map(|read| read.seq);
            self.recent(*topic)
                .filter(|sent| Some(sent.seq) > read)
                .filter_map(|sent| sent.arrives)
                .min()
        });
        waiting.max().unwrap_or(self.late.to).max(last)
    }

    /// Recent mean lateness of a node's ticks.
    fn lateness(&self, node: usize) -> Duration {
        let late = self
            .ticks(node)
            .map(|worked| worked.tick.lateness.unwrap_or_default());
        mean(late).unwrap_or_default()
    }

    /// Returns the length of the stretch.
    pub(super) fn time(&self) -> Duration {
        self.late.length()
    }
}

/// A tick that a knob makes long.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Hang {
    /// Run time of the knob: the tick is the next one.
    pub at: Time,
    /// The node.
    pub node: String,
    /// Duration of the tick.
    pub cost: Duration,
}

impl Hang {
    /// Returns the hang that `timed` causes, if any.
    pub fn from_knob(timed: &TimedKnob) -> Option<Self> {
        match &timed.knob {
            Knob::Hang { node, cost } => Some(Self {
                at: timed.at,
                node: node.clone(),
                cost: *cost,
            }),
            _ => None,
        }
    }

    /// Returns the hangs that a run with `setup` begins with.
    pub fn at_the_start(setup: &Setup) -> Vec<Self> {
        let at = Time::ZERO;
        setup
            .iter()
            .cloned()
            .map(|knob| TimedKnob { at, knob })
            .filter_map(|timed| Self::from_knob(&timed))
            .collect()
    }

    /// Returns when it may be going on, for a node with this `period`.
    pub fn span(&self, period: Duration) -> Range<Time> {
        self.at..self.at + period + self.cost
    }
}
