//! Makes frames of a running session.

use std::{
    collections::VecDeque,
    time::{Duration, Instant},
};

use ratelab::{
    cartpole::{ACTUATOR, ControlStep, POLICY, Pose, SENSOR},
    experiment::{Config, OBS, Summary, TimedKnob, Verdict},
    policy::PolicySpec,
    runtime::{
        ClockKind, Message, Observer, Snapshot, Time,
        telemetry::{NodeView, TopicView},
    },
};

use super::{
    cause::{Cadence, Facts},
    figures::{Figures, NodeFigures},
    frame::{
        FrameData, LatencyData, NodeData, PlantData, Quantiles, TopicData, Trace, VerdictData,
        VerdictKind,
    },
};

/// How long a node stays lit after a tick (wall time).
const LIT: Duration = Duration::from_millis(100);

/// Run time over which latencies count as recent.
const LATELY: Duration = Duration::from_secs(1);

/// Control steps kept for the angle chart: an hour at 50 Hz.
const STEPS_KEPT: usize = 180_000;

/// A run to make frames of: one that is under way, or a replay.
pub trait RunSource {
    /// What it was started with.
    fn config(&self) -> &Config;

    /// Reads the graph.
    fn observer(&self) -> &Observer;

    /// Wall time since it began, or that it took.
    fn wall_time(&self) -> Duration;

    /// The control steps since the last call.
    fn new_steps(&mut self) -> Vec<Message<ControlStep>>;

    /// Control steps that came too fast to be watched.
    fn lost(&self) -> u64;

    /// What it came to, if it is over.
    fn summary(&self) -> Option<&Summary>;

    /// Whether nothing moves.
    fn at_rest(&self) -> bool {
        self.observer().status().paused || self.summary().is_some()
    }
}

/// Remembers between frames what a frame needs of the past.
#[derive(Default)]
pub struct Sampler {
    /// Per node, its ticks at the last sample and when they last changed.
    ticks: Vec<(u64, Option<Instant>)>,
    /// Events that were looked at for the policy.
    events: usize,
    /// The last policy that was swapped in.
    swapped: Option<PolicySpec>,
    figures: Figures,
    newest: Option<ControlStep>,
    /// Run times and sense→act latencies of the last second.
    latencies: VecDeque<(Time, Duration)>,
    /// Run time (s) and pole angle (degrees) of every step.
    angles: VecDeque<(f64, f64)>,
}

impl Sampler {
    /// A frame of `session` as it is now.
    pub fn frame_data(&mut self, session: &mut impl RunSource) -> FrameData {
        for message in session.new_steps() {
            self.remember(&message);
        }
        self.follow_swaps(session.observer());
        let counters = session.observer().read_counters();
        let running = session.summary().is_none();
        let at_rest = session.at_rest();
        self.figures.refresh(session.observer(), &counters, at_rest);
        let lit = self.lit_nodes(&counters, running, at_rest);
        let figures = &self.figures;
        let nodes = counters.nodes.iter().zip(&figures.nodes).zip(lit);
        let topics = counters.topics.iter().zip(&figures.ages);
        FrameData {
            now: counters.now,
            wall_s: session.wall_time().as_secs(),
            status: counters.status,
            seed: session.config().seed,
            policy: self.policy(session).name().to_owned(),
            verdict: self.verdict(session, &counters),
            latency: LatencyData {
                newest: self.newest.and_then(|step| step.latency),
                control_period: counters.period(POLICY),
                ..figures.latency.clone()
            },
            nodes: nodes
                .map(|((node, figures), lit)| node_data(node, *figures, lit))
                .collect(),
            topics: topics
                .map(|(topic, age)| topic_data(topic, *age, counters.now))
                .collect(),
            plant: self.newest.as_ref().map(plant_data),
            telemetry_lost: session.lost(),
        }
    }

    /// The pole's angle in the `span` seconds before `now`.
    pub fn trace(&self, now: Time, span: f64) -> Trace {
        let end = now.as_secs_f64();
        let first = self.angles.partition_point(|(at, _)| *at < end - span);
        let last = self.angles.partition_point(|(at, _)| *at <= end);
        Trace {
            points: self.angles.range(first..last).copied().collect(),
            marks: Vec::new(),
        }
    }

    fn follow_swaps(&mut self, observer: &Observer) {
        let events = observer.events(self.events);
        self.events += events.len();
        let mut swaps = events.iter().rev().filter_map(TimedKnob::of);
        let last = swaps.find_map(|timed| timed.knob.policy().cloned());
        self.swapped = last.or(self.swapped.take());
    }

    /// The policy that decides now: the last that was swapped in, or the first.
    fn policy<'s>(&'s self, session: &'s impl RunSource) -> &'s PolicySpec {
        let first = &session.config().policy;
        self.swapped.as_ref().unwrap_or(first)
    }

    fn remember(&mut self, message: &Message<ControlStep>) {
        if self.angles.len() == STEPS_KEPT {
            self.angles.pop_front();
        }
        let degrees = angle(&message.data).to_degrees();
        self.angles
            .push_back((message.stamp.as_secs_f64(), degrees));
        self.newest = Some(message.data);
        self.latencies
            .extend(message.data.latency.map(|latency| (message.stamp, latency)));
        let old = |(at, _): &mut (Time, Duration)| message.stamp.since(*at) > LATELY;
        while self.latencies.pop_front_if(old).is_some() {}
    }

    /// Which nodes ticked a moment ago; while run time stands still, which ones
    /// ticked last.
    fn lit_nodes(&mut self, snapshot: &Snapshot, running: bool, at_rest: bool) -> Vec<bool> {
        self.ticks.resize(snapshot.nodes.len(), (0, None));
        let now = Instant::now();
        for (node, (ticks, changed)) in snapshot.nodes.iter().zip(&mut self.ticks) {
            if node.ticks != *ticks {
                (*ticks, *changed) = (node.ticks, Some(now));
            }
        }
        let last_change = self.ticks.iter().filter_map(|(_, changed)| *changed).max();
        let lit = |changed: Option<Instant>| match (changed, at_rest) {
            (None, _) => false,
            _ if !running => false,
            (changed, true) => changed == last_change,
            (Some(changed), false) => now - changed < LIT,
        };
        self.ticks
            .iter()
            .map(|(_, changed)| lit(*changed))
            .collect()
    }

    /// How it stands, and why it ended if it did, in figures that were measured.
    fn verdict(&self, session: &impl RunSource, snapshot: &Snapshot) -> VerdictData {
        let Some(summary) = session.summary() else {
            return VerdictData {
                kind: VerdictKind::Good,
                headline: "BALANCED so far".to_owned(),
                why: Vec::new(),
            };
        };
        let (kind, why) = match summary.verdict {
            Verdict::Balanced | Verdict::Stopped { .. } => (VerdictKind::Done, Vec::new()),
            Verdict::PoleFell { .. } | Verdict::CartLeftRail { .. } => {
                let pole_fell = matches!(summary.verdict, Verdict::PoleFell { .. });
                let facts = self.facts(session, snapshot, pole_fell);
                (VerdictKind::Lost, facts.reasons())
            }
        };
        VerdictData {
            kind,
            headline: summary.verdict.to_string(),
            why,
        }
    }

    /// What is known of a run that was lost.
    fn facts(&self, session: &impl RunSource, snapshot: &Snapshot, pole_fell: bool) -> Facts {
        let policy = self.policy(session);
        let obs = snapshot.topic(OBS);
        Facts {
            policy: policy.name().to_owned(),
            balances: policy.balances(),
            pole_fell,
            oldest: self.latencies.iter().map(|(_, latency)| *latency).max(),
            sensor: cadence(snapshot, SENSOR),
            decisions: cadence(snapshot, POLICY),
            step: snapshot.period(ACTUATOR),
            think: session.config().think,
            depth: obs.map_or(1, |obs| obs.depth),
            dropped: obs.map_or(0, TopicView::dropped),
        }
    }
}

/// How often `node` works. Overruns are those of the real clock, and say nothing of
/// a run that was handed over since.
fn cadence(snapshot: &Snapshot, node: &str) -> Cadence {
    let real = snapshot.status.clock == ClockKind::Real;
    let view = snapshot.node(node);
    Cadence {
        period: snapshot.period(node),
        ticks: view.map_or(0, |view| view.ticks),
        overruns: view.filter(|_| real).map_or(0, |view| view.overruns),
    }
}

fn angle(step: &ControlStep) -> f64 {
    Pose::of(step.qpos).pole_angle
}

fn plant_data(step: &ControlStep) -> PlantData {
    PlantData {
        pose: Pose::of(step.qpos),
        action: step.action.0,
        steps: step.step,
    }
}

fn node_data(node: &NodeView, figures: NodeFigures, lit: bool) -> NodeData {
    NodeData {
        name: node.name.clone(),
        hz: node.hz,
        ticks: node.ticks,
        overruns: node.overruns,
        lit,
        lateness: figures.lateness,
        tick_time: figures.tick_time,
    }
}

fn topic_data(topic: &TopicView, age: Quantiles, now: Time) -> TopicData {
    TopicData {
        name: topic.name.clone(),
        depth: topic.depth,
        published: topic.published,
        per_second: topic.per_second,
        average: topic.average(now),
        dropped: topic.dropped(),
        dropped_lately: topic.dropped_lately(),
        publishers: topic.publishers.clone(),
        readers: topic.subscriptions.iter().map(|s| s.node).collect(),
        age,
        held: topic.newest.map(|newest| now.since(newest)),
    }
}
