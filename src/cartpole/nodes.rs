//! Sense, think, act: the three nodes.

use thiserror::Error;

use super::{
    message::{Action, ControlStep, Observation},
    plant::SharedPlant,
    policy::Policy,
};
use crate::runtime::{
    END, GO_ON, Node, Publisher, Subscription, Tick, Time, telemetry::MeterRecorder,
};

/// Name of the node that reads the plant.
pub const SENSOR: &str = "sensor";

/// Name of the node that decides.
pub const POLICY: &str = "policy";

/// Name of the node that moves the plant.
pub const ACTUATOR: &str = "actuator";

/// Name of the actuator's measurement of how old the sensing behind an action
/// is when the action is applied.
pub const SENSE_TO_ACT: &str = "sense→act";

/// Reads the plant and publishes what it reads.
pub struct Sensor {
    /// What it reads.
    pub plant: SharedPlant,
    /// Where it publishes: `/obs`.
    pub observations: Publisher<Observation>,
}

impl Node for Sensor {
    fn tick(&mut self, now: Time) -> Tick {
        let observation = self.plant.lock().observe();
        self.observations.publish(observation, now, None);
        GO_ON
    }
}

/// Runs a policy on the newest observation. Knows two topics and nothing of
/// the plant, which is what makes the policy swappable.
pub struct PolicyNode {
    /// The policy.
    pub policy: Box<dyn Policy>,
    /// What it reads: `/obs`.
    pub observations: Subscription<Observation>,
    /// Where it publishes: `/action`.
    pub actions: Publisher<Action>,
}

/// A policy answered with something that is no force.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("the {policy} policy answered {action} to {observation:?}: an action must be finite")]
pub struct NotFinite {
    policy: String,
    action: f32,
    observation: Observation,
}

impl Node for PolicyNode {
    fn tick(&mut self, now: Time) -> Tick {
        let Some(sensed) = self.observations.latest(now) else {
            return GO_ON; // Nothing was sensed yet.
        };
        let action = self.policy.act(&sensed.data);
        if !action.0.is_finite() {
            return Err(Box::new(NotFinite {
                policy: self.policy.name().to_owned(),
                action: action.0,
                observation: sensed.data,
            }));
        }
        self.actions.publish(action, now, Some(sensed.stamp));
        GO_ON
    }

    /// Swaps the policy for the one that is named, if it can be swapped.
    fn on_message(&mut self, text: &str) -> Result<String, String> {
        self.policy.swap(text)
    }
}

/// Applies the newest action and moves the plant on by one control step. The
/// only node that does, so each of its ticks is 20 ms of the plant's time.
///
/// While the policy is quiet the last action is held (zero-order hold); before
/// the first there is no force.
pub struct Actuator {
    /// What it moves.
    pub plant: SharedPlant,
    /// What it obeys: `/action`.
    pub actions: Subscription<Action>,
    /// Where it publishes the result of each step: `/state`.
    pub steps: Publisher<ControlStep>,
    /// Age of the sensing behind each action when it is applied.
    pub sense_to_act: MeterRecorder,
}

impl Node for Actuator {
    fn tick(&mut self, now: Time) -> Tick {
        let command = self.actions.latest(now);
        let action = command.map_or(Action::ZERO, |command| command.data);
        let sensed = command.and_then(|command| command.origin);
        let latency = sensed.map(|sensed| now.since(sensed));
        if let Some(latency) = latency {
            self.sense_to_act.record(latency);
        }
        let (fall, step) = {
            let mut plant = self.plant.lock();
            let fall = plant.step(action);
            let step = ControlStep {
                step: plant.steps(),
                action: action.clipped(),
                latency,
                observation: plant.observe(),
                qpos: plant.qpos(),
                qvel: plant.qvel(),
            };
            (fall, step)
        };
        self.steps.publish(step, now, sensed);
        if fall.is_some() { END } else { GO_ON }
    }
}
