//! What a run came to.

use std::{fmt, time::Duration};

use serde::{Deserialize, Serialize};

use super::{ACTION, Config, OBS, TimedKnob};
use crate::{
    cartpole::{ACTUATOR, Fall, Plant, SENSE_TO_ACT},
    runtime::{
        ClockExit, Hz, Observer, Snapshot, Time,
        telemetry::{Distribution, Event, NodeView, TopicView},
    },
};

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Verdict {
    /// The pole was up for the whole run.
    Balanced,
    /// The pole was up when a command stopped the run.
    Stopped {
        /// Run time of the stop.
        at: Time,
    },
    /// The pole tipped beyond its limit.
    PoleFell {
        /// Run time of the control step that saw it.
        at: Time,
    },
    /// The cart left the rail with the pole still up.
    CartLeftRail {
        /// Run time of the control step that saw it.
        at: Time,
    },
}

impl Verdict {
    fn new(exit: &ClockExit, fall: Option<Fall>, now: Time) -> Self {
        let at = match exit {
            ClockExit::Ended { at, .. } => *at,
            _ => now,
        };
        match (fall, exit) {
            (Some(Fall::Pole), _) => Self::PoleFell { at },
            (Some(Fall::Cart), _) => Self::CartLeftRail { at },
            (None, ClockExit::Completed) => Self::Balanced,
            (None, _) => Self::Stopped { at },
        }
    }

    /// Whether the run was not lost: the pole was up as long as it lasted.
    pub fn balanced(&self) -> bool {
        matches!(self, Self::Balanced | Self::Stopped { .. })
    }

    /// One word for it, for programs.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Balanced => "balanced",
            Self::Stopped { .. } => "stopped",
            Self::PoleFell { .. } => "pole_fell",
            Self::CartLeftRail { .. } => "cart_left_rail",
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Balanced => f.write_str("BALANCED (pole up the whole run)"),
            Self::Stopped { at } => write!(f, "STOPPED at {at} (pole up so far)"),
            Self::PoleFell { at } => write!(f, "FELL at {at} (pole beyond ±12°)"),
            Self::CartLeftRail { at } => {
                write!(
                    f,
                    "LEFT THE RAIL at {at} (cart beyond ±2.4 m, pole still up)"
                )
            }
        }
    }
}

/// What a run came to.
#[derive(Clone, Debug)]
pub struct Summary {
    /// What defined it.
    pub config: Config,
    /// How it ended.
    pub verdict: Verdict,
    /// Control steps that the plant made.
    pub steps: u64,
    /// Run time at the end.
    pub sim_time: Time,
    /// Wall time that it took.
    pub wall_time: Duration,
    /// The pole's angle at the end (rad).
    pub final_pole_angle: f64,
    /// Sense→act latency of every actuation that had an action.
    pub latency: Distribution,
    /// What `/obs` carried.
    pub obs: TopicSummary,
    /// What `/action` carried.
    pub action: TopicSummary,
    /// The nodes, in the order sensor, policy, actuator.
    pub nodes: Vec<NodeSummary>,
    /// Commands and ends.
    pub events: Vec<Event>,
}

/// What a run came to, but for what its topics and nodes tell.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunEnd {
    /// How it ended.
    pub verdict: Verdict,
    /// Control steps that the plant made.
    pub steps: u64,
    /// Run time at the end.
    pub sim_time: Time,
    /// Wall time that it took.
    pub wall_time: Duration,
    /// The pole's angle at the end (rad).
    pub final_pole_angle: f64,
}

/// What a topic carried in a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TopicSummary {
    /// Its name.
    pub name: String,
    /// Messages published.
    pub published: u64,
    /// Messages lost unread.
    pub dropped: u64,
    /// Messages per second of run time.
    pub per_second: f64,
}

/// How a node kept its rate in a run.
#[derive(Clone, Debug)]
pub struct NodeSummary {
    /// Its name.
    pub name: String,
    /// Its rate at the end.
    pub hz: Hz,
    /// Ticks.
    pub ticks: u64,
    /// Periods skipped because it was still busy.
    pub overruns: u64,
    /// How late its ticks began; empty under the virtual clock.
    pub lateness: Distribution,
    /// How long its ticks took; empty where the virtual clock ran flat out.
    pub tick_time: Distribution,
}

impl Summary {
    /// The knobs as they were turned, up front or live: under the virtual clock
    /// the same configuration with these is the same run again.
    pub fn knobs(&self) -> Vec<TimedKnob> {
        self.events.iter().filter_map(TimedKnob::of).collect()
    }

    /// How it ended, without what topics and nodes tell.
    pub fn end(&self) -> RunEnd {
        RunEnd {
            verdict: self.verdict,
            steps: self.steps,
            sim_time: self.sim_time,
            wall_time: self.wall_time,
            final_pole_angle: self.final_pole_angle,
        }
    }

    /// The node called `name`.
    pub fn node(&self, name: &str) -> Option<&NodeSummary> {
        self.nodes.iter().find(|node| node.name == name)
    }

    pub(super) fn new(
        config: &Config,
        exit: &ClockExit,
        observer: &Observer,
        plant: &Plant,
        wall_time: Duration,
    ) -> Self {
        let now = observer.now();
        let end = RunEnd {
            verdict: Verdict::new(exit, plant.fall(), now),
            steps: plant.steps(),
            sim_time: match exit {
                ClockExit::Ended { at, .. } => *at,
                _ => now,
            },
            wall_time,
            final_pole_angle: plant.pose().pole_angle,
        };
        Self::observed(config, &end, observer)
    }

    /// The summary of a run of `config` that came to `end`, with what `observer`
    /// reads of it.
    pub fn observed(config: &Config, end: &RunEnd, observer: &Observer) -> Self {
        let snapshot = observer.snapshot();
        let sim_time = end.sim_time;
        Self {
            config: config.clone(),
            verdict: end.verdict,
            steps: end.steps,
            sim_time,
            wall_time: end.wall_time,
            final_pole_angle: end.final_pole_angle,
            latency: snapshot
                .meter(ACTUATOR, SENSE_TO_ACT)
                .cloned()
                .unwrap_or_else(Distribution::empty),
            obs: TopicSummary::of(OBS, &snapshot, sim_time),
            action: TopicSummary::of(ACTION, &snapshot, sim_time),
            nodes: snapshot.nodes.iter().map(NodeSummary::of).collect(),
            events: observer.events(0),
        }
    }
}

impl TopicSummary {
    fn of(name: &str, snapshot: &Snapshot, sim_time: Time) -> Self {
        let topic = snapshot.topic(name);
        Self {
            name: name.to_owned(),
            published: topic.map_or(0, |topic| topic.published),
            dropped: topic.map_or(0, TopicView::dropped),
            per_second: topic.map_or(0.0, |topic| topic.average(sim_time)),
        }
    }
}

impl NodeSummary {
    fn of(node: &NodeView) -> Self {
        Self {
            name: node.name.to_string(),
            hz: node.hz,
            ticks: node.ticks,
            overruns: node.overruns,
            lateness: node.lateness.clone(),
            tick_time: node.tick_time.clone(),
        }
    }
}
