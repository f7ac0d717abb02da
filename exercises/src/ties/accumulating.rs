//! A virtual clock that adds up periods, built from the library's parts.
//!
//! The nodes, the topics and the plant are the library's own. Only the schedule differs,
//! in a common but flawed form: after its tick a node is due again one period later, with
//! times as floating-point seconds.

use ratelab::{
    cartpole::{
        ACTION, Action, Actuator, ActuatorInput, CONTROL_HZ, ControlStep, OBS, Observation, Plant,
        PolicyNode, STATE, Sensor, SharedPlant,
    },
    policy::Scripted,
    runtime::{
        Depth, Node, Time, Topic,
        telemetry::{Distribution, Meter, PushAge},
    },
};

use crate::framework::Failure;

/// The result of a run under that clock.
pub struct Accumulated {
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

/// The three nodes of the cart-pole graph, to be ticked directly.
struct Nodes {
    sensor: Sensor,
    policy: PolicyNode,
    actuator: Actuator,
}

impl Nodes {
    /// The nodes by priority: of those due together the first one ticks first.
    fn by_priority(&mut self) -> [&mut dyn Node; 3] {
        [&mut self.sensor, &mut self.policy, &mut self.actuator]
    }
}

/// Runs the scripted policy at `control_hz` from the start for `seed` during `seconds`,
/// with defaults for the rest.
///
/// # Errors
/// [`Failure`] if the plant cannot be created, a node fails, or a time is invalid.
pub fn run(seed: u64, control_hz: f64, seconds: f64) -> Result<Accumulated, Failure> {
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
    schedule(&mut nodes, control_hz, seconds)?;
    Ok(Accumulated {
        latency: latency.read(),
        reading_age: nodes.policy.observations.ages().read(),
        action_age: nodes.actuator.input.actions.ages().read(),
        dropped: nodes.policy.observations.dropped(),
        steps: plant.lock().steps(),
    })
}

/// Ticks the nodes in the order of their due times until the pole falls or the time is
/// over.
fn schedule(nodes: &mut Nodes, control_hz: f64, seconds: f64) -> Result<(), Failure> {
    let periods = [CONTROL_HZ, control_hz, CONTROL_HZ].map(|hz| 1.0 / hz);
    let mut due = [0.0_f64; 3];
    loop {
        let first = (0..due.len()).min_by(|&a, &b| due[a].total_cmp(&due[b]));
        let Some(next) = first.filter(|&next| due[next] <= seconds) else {
            return Ok(());
        };
        let now = Time::from_secs_f64(due[next])?;
        let mut nodes = nodes.by_priority();
        let node = &mut nodes[next];
        if node.tick(now)?.is_break() || node.apply(now)?.is_break() {
            return Ok(());
        }
        // The bug: a period is rounded, and so is every sum. Two nodes that should be due
        // together soon differ in the last bit, and then the rounding decides their order
        // in place of the priority.
        due[next] += periods[next];
    }
}
