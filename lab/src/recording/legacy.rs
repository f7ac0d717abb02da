//! Recordings of format 1, all of the cart-pole, the only system at that time.

use std::{collections::BTreeMap, time::Duration};

use ratelab::{
    cartpole::{CartPole, verdict},
    experiment::Config,
    policy::PolicySpec,
    runtime::{ClockKind, Depth, Hz, Knob, Speed, Time, TimedKnob, telemetry::Topology},
    system::{System, WorldKind},
};
use serde::Deserialize;
use serde_json::Value;

use super::schema::{Origin, RecordingEnd, RunResult, VerdictRecord};

/// The origin of a run, from JSON of format 1.
pub fn origin(json: Value) -> Option<Origin> {
    let old: OldOrigin = serde_json::from_value(json).ok()?;
    Some(Origin {
        format: old.format,
        ratelab: old.ratelab,
        engine: Some(format!("MuJoCo {}", old.mujoco)),
        platform: old.platform,
        system: CartPole::default().name().to_owned(),
        graph_file: None,
        config: old.config.config()?,
        topology: old.shape,
        processes: Vec::new(),
    })
}

/// The end of the recording, from JSON of format 1.
pub fn end(mut json: Value) -> Option<RecordingEnd> {
    if let Some(end) = json.pointer_mut("/end/Ended") {
        let old: OldResult = serde_json::from_value(end.take()).ok()?;
        *end = serde_json::to_value(old.result()).ok()?;
    }
    serde_json::from_value(json).ok()
}

#[derive(Deserialize)]
struct OldOrigin {
    format: u32,
    ratelab: String,
    mujoco: String,
    platform: String,
    config: OldConfig,
    shape: Topology,
}

#[derive(Deserialize)]
struct OldConfig {
    seed: u64,
    clock: ClockKind,
    speed: Speed,
    end: Time,
    sensor_hz: Hz,
    control_hz: Hz,
    queue_depth: Depth,
    policy: PolicySpec,
    knobs: Vec<OldTimedKnob>,
}

#[derive(Deserialize)]
struct OldTimedKnob {
    at: Time,
    knob: OldKnob,
}

#[derive(Deserialize)]
enum OldKnob {
    ControlHz(Hz),
    SensorHz(Hz),
    QueueDepth(Depth),
    Policy(PolicySpec),
}

#[derive(Deserialize)]
struct OldResult {
    verdict: OldVerdict,
    steps: u64,
    sim_time: Time,
    wall_time: Duration,
    final_pole_angle: f64,
}

#[derive(Deserialize)]
enum OldVerdict {
    Balanced,
    Stopped { at: Time },
    PoleFell { at: Time },
    CartLeftRail { at: Time },
}

impl OldConfig {
    fn config(self) -> Option<Config> {
        let setup = [
            OldKnob::SensorHz(self.sensor_hz),
            OldKnob::ControlHz(self.control_hz),
            OldKnob::QueueDepth(self.queue_depth),
            OldKnob::Policy(self.policy),
        ];
        let setup: Option<Vec<_>> = setup.iter().map(OldKnob::knobs).collect();
        let mut knobs = Vec::new();
        for OldTimedKnob { at, knob } in self.knobs {
            let turned = knob.knobs()?.into_iter();
            knobs.extend(turned.map(|knob| TimedKnob { at, knob }));
        }
        Some(Config {
            seed: self.seed,
            clock: self.clock,
            speed: self.speed,
            end: self.end,
            setup: setup?.into_iter().flatten().collect(),
            world: WorldKind::Course,
            knobs,
        })
    }
}

impl OldKnob {
    /// The changed knobs of the graph.
    fn knobs(&self) -> Option<Vec<Knob>> {
        let (alias, value) = match self {
            Self::ControlHz(hz) => ("control-hz", hz.get().to_string()),
            Self::SensorHz(hz) => ("sensor-hz", hz.get().to_string()),
            Self::QueueDepth(depth) => ("queue-depth", depth.to_string()),
            Self::Policy(policy) => ("policy", policy.to_string()),
        };
        CartPole::KNOBS.alias(alias)?.set(&value).ok()
    }
}

impl OldResult {
    fn result(self) -> RunResult {
        let (kind, at) = match self.verdict {
            OldVerdict::Balanced => (&verdict::BALANCED, self.sim_time),
            OldVerdict::Stopped { at } => (&verdict::STOPPED, at),
            OldVerdict::PoleFell { at } => (&verdict::POLE_FELL, at),
            OldVerdict::CartLeftRail { at } => (&verdict::CART_LEFT_RAIL, at),
        };
        let angle = ("final_pole_angle".to_owned(), Some(self.final_pole_angle));
        RunResult {
            verdict: VerdictRecord {
                name: kind.name.to_owned(),
                at,
            },
            steps: self.steps,
            sim_time: self.sim_time,
            wall_time: self.wall_time,
            finals: BTreeMap::from([angle]),
        }
    }
}
