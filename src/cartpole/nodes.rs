//! Sense, think, act: the three nodes.

use thiserror::Error;

use super::{
    free_plant::FreePlant,
    message::{Action, ControlStep, Observation},
    on_stale::OnStale,
    plant::SharedPlant,
    policy::Policy,
};
use crate::{
    runtime::{
        END, GO_ON, Message, Node, Publisher, Subscription, Tick, Time, Topic, Wiring,
        telemetry::{MeterRecorder, PushAge},
    },
    system::SharedWorld,
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
pub struct Sensor<P = SharedPlant> {
    /// What it reads.
    pub plant: P,
    /// Where it publishes: `/obs`.
    pub observations: Publisher<Observation>,
}

/// Something that a sensor can read.
pub trait Observed: Send {
    /// What a perfect sensor reads at run time `now`.
    fn observe(&self, now: Time) -> Observation;
}

impl Observed for SharedPlant {
    fn observe(&self, _: Time) -> Observation {
        self.lock().observe()
    }
}

impl Observed for SharedWorld<FreePlant> {
    fn observe(&self, now: Time) -> Observation {
        self.at(now).observe()
    }
}

impl<P: Observed> Node for Sensor<P> {
    fn tick(&mut self, now: Time) -> Tick {
        let observation = self.plant.observe(now);
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
        self.actions.publish(action, now, Some(sensed.sensed()));
        GO_ON
    }

    /// Swaps the policy for the one that is named, if it can be swapped.
    fn on_message(&mut self, text: &str) -> Result<String, String> {
        self.policy.swap(text)
    }

    fn restart(&mut self) -> Result<(), String> {
        self.policy.restart()
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
    pub input: ActuatorInput,
    /// Where it publishes the result of each step: `/state`.
    pub steps: Publisher<ControlStep>,
}

/// What an actuator obeys: `/action`, and what it measures of it.
pub struct ActuatorInput {
    /// What it reads.
    pub actions: Subscription<Action>,
    /// Age of the sensing behind each action when it is applied.
    pub sense_to_act: MeterRecorder,
    /// The same at any time.
    pub push_age: PushAge,
    command: Option<Message<Action>>,
    on_stale: OnStale,
}

impl ActuatorInput {
    /// The input that is read from `actions`.
    pub fn new(
        actions: Subscription<Action>,
        sense_to_act: MeterRecorder,
        push_age: PushAge,
    ) -> Self {
        Self {
            actions,
            sense_to_act,
            push_age,
            command: None,
            on_stale: OnStale::Hold,
        }
    }

    /// The same, with its ends taken from the `wiring` of an actuator.
    pub fn wired(wiring: &mut Wiring<'_>, actions: &Topic<Action>) -> Self {
        let actions = wiring.subscription(actions);
        Self::new(actions, wiring.meter(SENSE_TO_ACT), wiring.push_age())
    }

    /// Reads the newest action.
    fn read(&mut self, now: Time) {
        self.command = self.actions.latest(now);
    }

    /// What is applied `now`: the action that was read, unless that is stale.
    fn applied(&mut self, now: Time) -> Option<Message<Action>> {
        let sensed = self.command.and_then(|command| command.origin);
        if let Some(sensed) = sensed {
            self.sense_to_act.record(now.since(sensed));
            self.push_age.push(now, sensed);
        }
        let mut command = self.command?;
        if sensed.is_some_and(|sensed| !self.on_stale.allows(now.since(sensed))) {
            command.data = Action::ZERO;
        }
        Some(command)
    }

    /// Sets what to do with stale actions; returns what it was before.
    fn set_on_stale(&mut self, text: &str) -> Result<String, String> {
        let before = std::mem::replace(&mut self.on_stale, text.parse()?);
        Ok(before.to_string())
    }
}

impl Node for Actuator {
    fn tick(&mut self, now: Time) -> Tick {
        self.input.read(now);
        GO_ON
    }

    fn apply(&mut self, now: Time) -> Tick {
        let command = self.input.applied(now);
        let action = command.map_or(Action::ZERO, |command| command.data);
        let sensed = command.and_then(|command| command.origin);
        let (fall, step) = {
            let mut plant = self.plant.lock();
            let fall = plant.step(action);
            let step = ControlStep {
                step: plant.steps(),
                action: action.clipped(),
                latency: sensed.map(|sensed| now.since(sensed)),
                observation: plant.observe(),
                qpos: plant.qpos(),
                qvel: plant.qvel(),
            };
            (fall, step)
        };
        self.steps.publish(step, now, sensed);
        if fall.is_some() { END } else { GO_ON }
    }

    fn on_message(&mut self, text: &str) -> Result<String, String> {
        self.input.set_on_stale(text)
    }
}

/// Applies the newest action to a plant that moves by itself.
pub struct FreeActuator {
    /// What it pushes.
    pub plant: SharedWorld<FreePlant>,
    /// What it obeys: `/action`.
    pub input: ActuatorInput,
}

impl Node for FreeActuator {
    fn tick(&mut self, now: Time) -> Tick {
        self.input.read(now);
        GO_ON
    }

    fn apply(&mut self, now: Time) -> Tick {
        if let Some(command) = self.input.applied(now) {
            let mut plant = self.plant.at(now);
            plant.push(now, command.data, command.origin);
        }
        GO_ON
    }

    fn on_message(&mut self, text: &str) -> Result<String, String> {
        self.input.set_on_stale(text)
    }
}
