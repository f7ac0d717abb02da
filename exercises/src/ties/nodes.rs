//! The cart-pole's graph, to be ticked by any schedule.
//!
//! The nodes, the topics and the plant are the library's own; only the schedule is
//! somebody else's.

use ratelab::{Depth, Distribution, Meter, Node, PushAge, Time, Topic};
use ratelab_cart_pole::{
    ACTION, Action, Actuator, ActuatorInput, ControlStep, OBS, Observation, Plant, PolicyNode,
    STATE, Sensor, SharedPlant, policy::Scripted,
};

use crate::framework::Failure;

/// The result of a run under some schedule.
pub struct ScheduledRun {
    /// Sense→act latency.
    pub latency: Distribution,
    /// Ages of readings when the policy used them.
    pub reading_age: Distribution,
    /// Ages of actions when the actuator applied them.
    pub action_age: Distribution,
    /// Readings lost unread.
    pub dropped: u64,
    /// Control steps of the plant.
    pub steps: u64,
}

/// The nodes by priority: sensor, policy and actuator.
pub struct Nodes {
    sensor: Sensor,
    policy: PolicyNode,
    actuator: Actuator,
}

impl Nodes {
    /// Ticks node number `node` at run time `now`; returns whether the run goes on.
    ///
    /// # Errors
    /// [`Failure`] if the node fails.
    pub fn tick(&mut self, node: usize, now: Time) -> Result<bool, Failure> {
        let nodes: [&mut dyn Node; 3] = [&mut self.sensor, &mut self.policy, &mut self.actuator];
        let Some(node) = nodes.into_iter().nth(node) else {
            return Ok(false);
        };
        Ok(node.tick(now)?.is_continue() && node.apply(now)?.is_continue())
    }
}

/// Runs the scripted policy from the start for `seed`, with defaults for the rest, as
/// `schedule` ticks the nodes.
///
/// # Errors
/// [`Failure`] if the plant cannot be created, or of the schedule.
pub fn run(
    seed: u64,
    schedule: impl FnOnce(&mut Nodes) -> Result<(), Failure>,
) -> Result<ScheduledRun, Failure> {
    let plant = SharedPlant::new(Plant::new(seed)?);
    let observations = Topic::<Observation>::new(OBS, Depth::ONE);
    let actions = Topic::<Action>::new(ACTION, Depth::ONE);
    let steps = Topic::<ControlStep>::new(STATE, Depth::ONE);
    let (sense_to_act, latency) = Meter::new();
    let mut nodes = Nodes {
        sensor: Sensor {
            plant: plant.clone(),
            observations: observations.publisher(),
        },
        policy: PolicyNode {
            policy: Box::new(Scripted),
            observations: observations.subscribe(),
            actions: actions.publisher(),
        },
        actuator: Actuator {
            plant: plant.clone(),
            input: ActuatorInput::new(actions.subscribe(), sense_to_act, PushAge::default()),
            steps: steps.publisher(),
        },
    };
    schedule(&mut nodes)?;
    Ok(ScheduledRun {
        latency: latency.read(),
        reading_age: nodes.policy.observations.ages().read(),
        action_age: nodes.actuator.input.actions.ages().read(),
        dropped: nodes.policy.observations.dropped(),
        steps: plant.lock().steps(),
    })
}
