//! A recorded run told again, to the counters that the dashboard reads.

use std::sync::Arc;

use ratelab::{
    cartpole::{ACTUATOR, ControlStep, Pose, SENSE_TO_ACT},
    experiment::{Config, RunEnd, STATE, Summary, Verdict},
    runtime::{
        Message, Observer, Time,
        telemetry::{Happening, Retelling, Status},
    },
};

use super::{reader::Recording, schema::End};

/// One thing that happened, by its place in the recording.
#[derive(Clone, Copy, Debug)]
enum Item {
    Event(usize),
    Tick { node: usize, index: usize },
    Message { topic: usize, index: usize },
}

/// A recording, told up to some run time.
pub struct Retold {
    recording: Arc<Recording>,
    /// Everything in the order in which it happened.
    order: Vec<(Time, Item)>,
    /// How much of it is told.
    told: usize,
    retelling: Retelling,
    newest: Option<ControlStep>,
    /// The topic of control steps, and the node that makes them.
    steps: Option<usize>,
    actuator: Option<usize>,
}

impl Retold {
    /// Nothing is told yet.
    pub fn new(recording: Arc<Recording>) -> Self {
        let shape = &recording.origin.shape;
        Self {
            order: order(&recording),
            told: 0,
            retelling: begin(&recording),
            newest: None,
            steps: shape.topics.iter().position(|topic| topic.name == STATE),
            actuator: shape.nodes.iter().position(|node| node.name == ACTUATOR),
            recording,
        }
    }

    /// What is told.
    pub fn recording(&self) -> &Recording {
        &self.recording
    }

    /// Reads the counters as they stand.
    pub fn observer(&self) -> Observer {
        self.retelling.observer()
    }

    /// Run time of the first thing that is recorded.
    pub fn begins(&self) -> Time {
        let first = self
            .order
            .iter()
            .find(|(_, item)| !matches!(item, Item::Event(_)));
        first.map_or(Time::ZERO, |(at, _)| *at)
    }

    /// Whether all is told, and the run had ended.
    pub fn is_over(&self) -> bool {
        let ended = self.recording.outcome.as_ref();
        let ended = ended.is_some_and(|outcome| outcome.end != End::WentOn);
        ended && self.told == self.order.len()
    }

    /// Run time of the next thing to be told.
    pub fn next(&self) -> Option<Time> {
        self.order.get(self.told).map(|(at, _)| *at)
    }

    /// Run time of the thing told before the last instant.
    pub fn previous(&self) -> Option<Time> {
        let (last, _) = self.order.get(self.told.checked_sub(1)?)?;
        let before = self.order.partition_point(|(at, _)| at < last);
        self.order.get(before.checked_sub(1)?).map(|(at, _)| *at)
    }

    /// Tells on, up to run time `until`; returns the control steps on the way.
    pub fn tell(&mut self, until: Time) -> Vec<Message<ControlStep>> {
        let mut steps = Vec::new();
        while let Some((_, item)) = self.order.get(self.told).filter(|(at, _)| *at <= until) {
            let item = *item;
            self.told += 1;
            steps.extend(self.tell_item(item));
        }
        self.tell_losses(until);
        self.retelling.come_to(until);
        steps
    }

    /// Forgets all that was told.
    pub fn rewind(&mut self) {
        self.told = 0;
        self.newest = None;
        self.retelling = begin(&self.recording);
    }

    /// Tells what was lost unread in all of the run, if it is told to its end.
    fn tell_losses(&mut self, until: Time) {
        let told = self.told == self.order.len() && until >= self.recording.until;
        let outcome = self.recording.outcome.as_ref().filter(|_| told);
        let losses = outcome.and_then(|outcome| outcome.dropped.as_ref());
        for (topic, dropped) in losses.into_iter().flatten().enumerate() {
            self.retelling.lost(topic, *dropped);
        }
    }

    fn tell_item(&mut self, item: Item) -> Option<Message<ControlStep>> {
        match item {
            Item::Event(index) => self.retelling.event(&self.recording.events[index]),
            Item::Tick { node, index } => {
                self.retelling
                    .tick(node, &self.recording.ticks[node][index]);
            }
            Item::Message { topic, index } => {
                let head = &self.recording.topics[topic].heads[index];
                self.retelling
                    .message(topic, head.seq, head.stamp, head.dropped);
                if Some(topic) == self.steps {
                    return self.tell_step(topic, index);
                }
            }
        }
        None
    }

    fn tell_step(&mut self, topic: usize, index: usize) -> Option<Message<ControlStep>> {
        let step: Message<ControlStep> = self.recording.topics[topic].message(index)?;
        if let (Some(node), Some(latency)) = (self.actuator, step.data.latency) {
            self.retelling.sample(node, SENSE_TO_ACT, latency);
        }
        self.newest = Some(step.data);
        Some(step)
    }

    /// The configuration of the run.
    pub fn config(&self) -> &Config {
        &self.recording.origin.config
    }

    /// What the run came to, or the recording of it, with what is told so far.
    pub fn summary(&self) -> Summary {
        let end = match self.recording.outcome.as_ref().map(|outcome| &outcome.end) {
            Some(End::Ended(end)) => *end,
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
fn begin(recording: &Recording) -> Retelling {
    let origin = &recording.origin;
    let status = Status {
        clock: origin.config.clock,
        paused: false,
        speed: origin.config.speed,
    };
    Retelling::new(&origin.shape, status)
}

/// Everything in the order in which it happened. At one run time commands come
/// first, then nodes by priority, each tick before what was published in it,
/// and ends last.
fn order(recording: &Recording) -> Vec<(Time, Item)> {
    let shape = &recording.origin.shape;
    let priority = |node: usize| {
        shape
            .nodes
            .get(node)
            .map_or(0, |node| u64::from(node.priority))
    };
    let mut order = Vec::new();
    for (index, event) in recording.events.iter().enumerate() {
        let command = matches!(
            event.what,
            Happening::Applied { .. } | Happening::Refused { .. }
        );
        let rank = if command { 0 } else { u64::MAX };
        order.push(((event.at, rank), Item::Event(index)));
    }
    for (node, ticks) in recording.ticks.iter().enumerate() {
        let rank = 1 + 2 * priority(node);
        let ticks = ticks.iter().enumerate();
        order.extend(ticks.map(|(index, tick)| ((tick.at, rank), Item::Tick { node, index })));
    }
    for (topic, track) in recording.topics.iter().enumerate() {
        let publisher = shape.topics[topic].publishers.first();
        let rank = 2 + 2 * publisher.map_or(0, |node| priority(*node));
        let heads = track.heads.iter().enumerate();
        order.extend(
            heads.map(|(index, head)| ((head.stamp, rank), Item::Message { topic, index })),
        );
    }
    order.sort_by_key(|(place, _)| *place);
    order
        .into_iter()
        .map(|((at, _), item)| (at, item))
        .collect()
}
