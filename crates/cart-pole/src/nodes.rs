//! The nodes of the cart-pole, and what the actuator does with a stale action.

use std::{fmt, str::FromStr, time::Duration};

use ratelab::{
    Draw, Flow, Message, MeterRecorder, Node, NodeCrash, NodeError, Publisher, Subscription, Tick,
    TickResult, Time, Topic, Wiring, millis::to_millis,
};
use ratelab_system::SharedWorld;
use thiserror::Error;

use crate::{
    ParameterError,
    message::{Action, ControlStep, Observation, SimilarReadings},
    plant::{CartPlant, Newtons, Plant},
    policy::{Moment, Policy},
};

/// Name of the node that reads the plant.
pub const SENSOR: &str = "sensor";

/// Name of the node that decides.
pub const POLICY: &str = "policy";

/// Name of the node that moves the plant.
pub const ACTUATOR: &str = "actuator";

/// Name of the actuator's parameter for the random force on the cart (N).
pub(crate) const DISTURB: &str = "disturb";

/// Name of the policy's parameter for what it sees.
pub(crate) const OBSERVE: &str = "observe";

/// Name of the sensor's parameter for the distance below which readings are similar.
pub(crate) const SIMILAR: &str = "similar";

/// Name of the actuator's meter of the age of the sensing behind an action when the
/// action is applied.
pub const SENSE_TO_ACT: &str = "sense→act";

/// Reads the plant and publishes the readings, but for similar ones.
pub struct Sensor<P = Plant> {
    /// The plant.
    pub plant: SharedWorld<P>,
    /// Publisher of `/obs`.
    pub observations: Publisher<Observation>,
    /// Which readings are not published.
    pub similar: SimilarReadings,
}

impl<P: CartPlant> Node for Sensor<P> {
    fn tick(&mut self, tick: &mut Tick) -> TickResult {
        let observation = self.plant.at(tick.now()).observe();
        if self.similar.pass(&observation) {
            tick.publish(&self.observations, observation);
        }
        Ok(Flow::Continue)
    }

    fn set_parameter(&mut self, name: &str, value: &str, _: Time) -> Result<String, NodeError> {
        match name {
            SIMILAR => Ok(self.similar.set(value)?),
            _ => Err(format!("the sensor has no parameter {name:?}").into()),
        }
    }
}

/// Runs a policy on the newest observation. Depends on two topics only and not on the
/// plant, which makes the policy exchangeable.
pub struct PolicyNode {
    /// The policy.
    pub policy: Box<dyn Policy>,
    /// Subscription to `/obs`.
    pub observations: Subscription<Observation>,
    /// Publisher of `/action`.
    pub actions: Publisher<Action>,
}

/// A policy returned NaN or an infinite action.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("the {policy} policy answered {action} to {observation:?}: an action must be finite")]
pub struct NotFinite {
    policy: String,
    action: f32,
    observation: Observation,
}

impl NotFinite {
    pub(super) fn new(policy: &str, action: Action, observation: Observation) -> Self {
        Self {
            policy: policy.to_owned(),
            action: action.0,
            observation,
        }
    }
}

impl Node for PolicyNode {
    fn tick(&mut self, tick: &mut Tick) -> TickResult {
        let Some(sensed) = tick.read(&mut self.observations) else {
            return Ok(Flow::Continue); // No reading yet.
        };
        self.policy.begin(Moment {
            origin: sensed.sensed(),
            now: tick.now(),
            ..Moment::default()
        });
        let action = self.policy.act(&sensed.data);
        if let Some(why) = self.policy.crash() {
            return Err(NodeCrash(why).into());
        }
        if !action.0.is_finite() {
            return Err(NotFinite::new(self.policy.name(), action, sensed.data).into());
        }
        tick.publish(&self.actions, action);
        Ok(Flow::Continue)
    }

    /// Replaces the policy by the named one, if it supports that.
    fn on_order(&mut self, text: &str) -> Result<String, NodeError> {
        Ok(self.policy.swap(text)?)
    }

    fn set_parameter(&mut self, name: &str, _: &str, _: Time) -> Result<String, NodeError> {
        Err(format!(
            "{name} is for a policy that answers with chunks: begin the run with --chunk H"
        )
        .into())
    }

    fn restart(&mut self) -> Result<(), NodeError> {
        Ok(self.policy.restart()?)
    }
}

/// Applies the newest action, and advances a plant that does not move by itself by one control
/// step. No other node advances it, so each tick is 20 ms of the plant's time.
///
/// Between actions the last one is held (zero-order hold); before the first there is no
/// force.
pub struct Actuator<P = Plant> {
    /// The plant.
    pub plant: SharedWorld<P>,
    /// Subscription to `/action`.
    pub actions: Subscription<Action>,
    /// Age of the sensing behind each action when it is applied.
    pub sense_to_act: MeterRecorder,
    /// Publisher of the result of each step, `/state`; `None` for a plant that moves by itself.
    pub steps: Option<Publisher<ControlStep>>,
    command: Option<Message<Action>>,
    on_stale: OnStale,
}

impl<P> Actuator<P> {
    /// Creates an actuator of `plant` that reads from `actions` and publishes to `steps`, if it is
    /// to, with ends from its `wiring`.
    pub fn wired(
        wiring: &mut Wiring<'_>,
        plant: SharedWorld<P>,
        actions: &Topic<Action>,
        steps: Option<&Topic<ControlStep>>,
    ) -> Self {
        Self {
            plant,
            actions: wiring.subscription(actions),
            sense_to_act: wiring.meter(SENSE_TO_ACT),
            steps: steps.map(|steps| wiring.publisher(steps)),
            command: None,
            on_stale: OnStale::Hold,
        }
    }

    /// Returns the action to apply in this `tick`: the last one read, with no force if it is stale.
    fn applied(&mut self, tick: &mut Tick) -> Option<Message<Action>> {
        let mut command = self.command?;
        // One from another process may not say what it was derived from.
        if let Some(sensed) = command.origin {
            let age = tick.now().since(sensed);
            self.sense_to_act.record(age);
            tick.act_on(sensed);
            if !self.on_stale.allows(age) {
                command.data = Action::ZERO;
            }
        }
        Some(command)
    }
}

impl<P: CartPlant> Node for Actuator<P> {
    fn tick(&mut self, tick: &mut Tick) -> TickResult {
        self.command = tick.read(&mut self.actions);
        Ok(Flow::Continue)
    }

    fn apply(&mut self, tick: &mut Tick) -> TickResult {
        let now = tick.now();
        let command = self.applied(tick);
        if command.is_none() && self.steps.is_none() {
            return Ok(Flow::Continue); // It moves on without one.
        }
        let moved = self.plant.at(now).push(now, command);
        let (Some((step, is_lost)), Some(steps)) = (moved, &self.steps) else {
            return Ok(Flow::Continue);
        };
        let sensed = command.and_then(|command| command.origin);
        tick.publish_stamped(steps, step, sensed);
        Ok(if is_lost { Flow::End } else { Flow::Continue })
    }

    /// Sets the handling of stale actions.
    fn on_order(&mut self, text: &str) -> Result<String, NodeError> {
        let before = std::mem::replace(&mut self.on_stale, text.parse::<OnStale>()?);
        Ok(before.to_string())
    }

    fn set_parameter(&mut self, name: &str, value: &str, now: Time) -> Result<String, NodeError> {
        if name != DISTURB {
            return Err(format!("the actuator has no parameter {name:?}").into());
        }
        let newtons = value.parse::<Newtons>()?;
        let before = self.plant.at(now).disturb(now, newtons);
        Ok(before.to_string())
    }
}

/// The actuator's handling of an action with old sensing. As text `hold`, or `zero:50`
/// (ms).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OnStale {
    /// Applies it again.
    #[default]
    Hold,
    /// Applies no force beyond this age.
    Zero(Duration),
}

impl OnStale {
    /// Returns whether an action of this age is applied.
    pub fn allows(self, age: Duration) -> bool {
        match self {
            Self::Hold => true,
            Self::Zero(limit) => age <= limit,
        }
    }
}

impl fmt::Display for OnStale {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Hold => f.write_str("hold"),
            Self::Zero(limit) => write!(f, "zero:{}", to_millis(*limit)),
        }
    }
}

impl FromStr for OnStale {
    type Err = ParameterError;

    fn from_str(text: &str) -> Result<Self, ParameterError> {
        if text.trim() == "hold" {
            return Ok(Self::Hold);
        }
        let limit = text
            .trim()
            .strip_prefix("zero:")
            .filter(|limit| *limit != "none")
            .map(str::parse);
        match limit {
            Some(Ok(Draw::Constant(limit))) => Ok(Self::Zero(limit)),
            _ => Err(ParameterError::OnStale(text.to_owned())),
        }
    }
}
