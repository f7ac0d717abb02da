//! The replay of a recorded run, into the counters that the dashboard reads.

use std::sync::Arc;

use ratelab::{
    cartpole::{ACTUATOR, ControlStep, Pose, SENSE_TO_ACT},
    experiment::{Config, RunEnd, STATE, Summary, Verdict},
    runtime::{
        Message, Observer, Time,
        telemetry::{EventKind, ReplayCounters, Status},
    },
};

use super::{reader::Recording, schema::RunStatus};

/// One thing that happened, by its place in the recording.
#[derive(Clone, Copy, Debug)]
enum ReplayItem {
    Event(usize),
    Tick { node: usize, index: usize },
    Message { topic: usize, index: usize },
}

/// A recording, replayed up to some run time.
pub struct Replay {
    recording: Arc<Recording>,
    /// Everything in the order in which it happened.
    order: Vec<(Time, ReplayItem)>,
    /// How much of it is replayed.
    done: usize,
    counters: ReplayCounters,
    newest: Option<ControlStep>,
    /// The topic of control steps, and the node that makes them.
    steps: Option<usize>,
    actuator: Option<usize>,
}

impl Replay {
    /// Nothing is replayed yet.
    pub fn new(recording: Arc<Recording>) -> Self {
        let topology = &recording.origin.topology;
        Self {
            order: order(&recording),
            done: 0,
            counters: begin(&recording),
            newest: None,
            steps: topology.topics.iter().position(|topic| topic.name == STATE),
            actuator: topology.nodes.iter().position(|node| node.name == ACTUATOR),
            recording,
        }
    }

    /// What is replayed.
    pub fn recording(&self) -> &Recording {
        &self.recording
    }

    /// Reads the counters as they stand.
    pub fn observer(&self) -> Observer {
        self.counters.observer()
    }

    /// Run time of the first thing that is recorded.
    pub fn begins(&self) -> Time {
        let first = self
            .order
            .iter()
            .find(|(_, item)| !matches!(item, ReplayItem::Event(_)));
        first.map_or(Time::ZERO, |(at, _)| *at)
    }

    /// Whether all is replayed, and the run had ended.
    pub fn is_over(&self) -> bool {
        let ended = self.recording.outcome.as_ref();
        let ended = ended.is_some_and(|outcome| outcome.end != RunStatus::WentOn);
        ended && self.done == self.order.len()
    }

    /// Run time of the next item.
    pub fn next(&self) -> Option<Time> {
        self.order.get(self.done).map(|(at, _)| *at)
    }

    /// Run time of the item before the last instant.
    pub fn previous(&self) -> Option<Time> {
        let (last, _) = self.order.get(self.done.checked_sub(1)?)?;
        let before = self.order.partition_point(|(at, _)| at < last);
        self.order.get(before.checked_sub(1)?).map(|(at, _)| *at)
    }

    /// Replays up to run time `until`; returns the control steps on the way.
    pub fn advance_to(&mut self, until: Time) -> Vec<Message<ControlStep>> {
        let mut steps = Vec::new();
        while let Some((_, item)) = self.order.get(self.done).filter(|(at, _)| *at <= until) {
            let item = *item;
            self.done += 1;
            steps.extend(self.apply(item));
        }
        self.tell_losses(until);
        self.counters.advance_to(until);
        steps
    }

    /// Goes back to the beginning.
    pub fn rewind(&mut self) {
        self.done = 0;
        self.newest = None;
        self.counters = begin(&self.recording);
    }

    /// Tells what was lost unread in all of the run, if it is told to its end.
    fn tell_losses(&mut self, until: Time) {
        let done = self.done == self.order.len() && until >= self.recording.until;
        let outcome = self.recording.outcome.as_ref().filter(|_| done);
        let losses = outcome.and_then(|outcome| outcome.dropped.as_ref());
        for (topic, dropped) in losses.into_iter().flatten().enumerate() {
            self.counters.lost(topic, *dropped);
        }
    }

    fn apply(&mut self, item: ReplayItem) -> Option<Message<ControlStep>> {
        match item {
            ReplayItem::Event(index) => self.counters.event(&self.recording.events[index]),
            ReplayItem::Tick { node, index } => {
                self.counters.tick(node, &self.recording.ticks[node][index]);
            }
            ReplayItem::Message { topic, index } => {
                let head = &self.recording.topics[topic].heads[index];
                self.counters
                    .message(topic, head.seq, head.stamp, head.dropped);
                if Some(topic) == self.steps {
                    return self.apply_step(topic, index);
                }
            }
        }
        None
    }

    fn apply_step(&mut self, topic: usize, index: usize) -> Option<Message<ControlStep>> {
        let step: Message<ControlStep> = self.recording.topics[topic].message(index)?;
        if let (Some(node), Some(latency)) = (self.actuator, step.data.latency) {
            self.counters.sample(node, SENSE_TO_ACT, latency);
        }
        self.newest = Some(step.data);
        Some(step)
    }

    /// The configuration of the run.
    pub fn config(&self) -> &Config {
        &self.recording.origin.config
    }

    /// What the run came to, or the recording of it, with what is replayed so far.
    pub fn summary(&self) -> Summary {
        let end = match self.recording.outcome.as_ref().map(|outcome| &outcome.end) {
            Some(RunStatus::Ended(end)) => *end,
            _ => self.end_so_far(),
        };
        Summary::observed(self.config(), &end, &self.observer())
    }

    fn end_so_far(&self) -> RunEnd {
        let at = self.recording.until;
        RunEnd {
            verdict: Verdict::Stopped { at },
            steps: self.newest.map_or(0, |step| step.step),
            sim_time: at,
            wall_time: std::time::Duration::from_nanos(at.as_nanos()),
            final_pole_angle: self
                .newest
                .map_or(0.0, |step| Pose::of(step.qpos).pole_angle),
        }
    }
}

/// Counters at zero.
fn begin(recording: &Recording) -> ReplayCounters {
    let origin = &recording.origin;
    let status = Status {
        clock: origin.config.clock,
        paused: false,
        speed: origin.config.speed,
    };
    ReplayCounters::new(&origin.topology, status)
}

/// Everything in the order in which it happened. At one run time commands come
/// first, then nodes by priority, each tick before what was published in it,
/// and ends last.
fn order(recording: &Recording) -> Vec<(Time, ReplayItem)> {
    let topology = &recording.origin.topology;
    let priority = |node: usize| {
        topology
            .nodes
            .get(node)
            .map_or(0, |node| u64::from(node.priority))
    };
    let mut order = Vec::new();
    for (index, event) in recording.events.iter().enumerate() {
        let command = matches!(
            event.what,
            EventKind::Applied { .. } | EventKind::Refused { .. }
        );
        let rank = if command { 0 } else { u64::MAX };
        order.push(((event.at, rank), ReplayItem::Event(index)));
    }
    for (node, ticks) in recording.ticks.iter().enumerate() {
        let rank = 1 + 2 * priority(node);
        let ticks = ticks.iter().enumerate();
        order
            .extend(ticks.map(|(index, tick)| ((tick.at, rank), ReplayItem::Tick { node, index })));
    }
    for (topic, track) in recording.topics.iter().enumerate() {
        let publisher = topology.topics[topic].publishers.first();
        let rank = 2 + 2 * publisher.map_or(0, |node| priority(*node));
        let heads = track.heads.iter().enumerate();
        order.extend(
            heads.map(|(index, head)| ((head.stamp, rank), ReplayItem::Message { topic, index })),
        );
    }
    order.sort_by_key(|(place, _)| *place);
    order
        .into_iter()
        .map(|((at, _), item)| (at, item))
        .collect()
}
