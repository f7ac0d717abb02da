//! The cart-pole's graph, to be ticked by any schedule.
//!
//! The nodes, the topics and the plant are the library's own; only the schedule is
//! somebody else's.

use ratelab::{Depth, Flow, Graph, GraphError, Hz, Node, Tick, Time, Topic, Wiring};
use ratelab_cart_pole::{
    ACTION, ACTUATOR, Action, Actuator, ControlStep, OBS, Observation, POLICY, Plant, PolicyNode,
    SENSOR, STATE, Sensor, SharedPlant, SimilarReadings, policy::Scripted,
};
use ratelab_metrics::Observer;
use ratelab_system::BuildError;

use super::TimedRun;
use crate::framework::Failure;

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
        let mut tick = Tick::at(now);
        let flow = node.tick(&mut tick)?;
        Ok(flow.and(node.apply(&mut tick)?) == Flow::Continue)
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
) -> Result<TimedRun, Failure> {
    let plant = SharedPlant::new(Plant::new(seed)?);
    let (graph, mut nodes) = wired(&plant)?;
    let observer = Observer::new(&graph);
    schedule(&mut nodes)?;
    let steps = plant.at(Time::ZERO).steps();
    Ok(TimedRun::new(&observer.snapshot(), steps))
}

/// Returns the nodes, with their ends of topics from a graph that only measures: it never runs.
fn wired(plant: &SharedPlant) -> Result<(Graph, Nodes), BuildError> {
    let mut graph = Graph::new();
    let observations = Topic::<Observation>::new(OBS, Depth::ONE);
    let actions = Topic::<Action>::new(ACTION, Depth::ONE);
    let steps = Topic::<ControlStep>::new(STATE, Depth::ONE);
    let sensor = taken(&mut graph, SENSOR, |wiring| Sensor {
        plant: plant.clone(),
        observations: wiring.publisher(&observations),
        similar: SimilarReadings::default(),
    })?;
    let policy = taken(&mut graph, POLICY, |wiring| PolicyNode {
        policy: Box::new(Scripted),
        observations: wiring.subscription(&observations),
        actions: wiring.publisher(&actions),
    })?;
    let actuator = taken(&mut graph, ACTUATOR, |wiring| {
        Actuator::wired(wiring, plant.clone(), &actions, Some(&steps))
    })?;
    let nodes = Nodes {
        sensor,
        policy,
        actuator,
    };
    Ok((graph, nodes))
}

/// Adds a node called `name` to the graph, and takes it out to be ticked from elsewhere.
fn taken<N>(
    graph: &mut Graph,
    name: &str,
    build: impl FnOnce(&mut Wiring<'_>) -> N,
) -> Result<N, GraphError> {
    let mut node = None;
    graph.node(name, Hz::MIN, 0, |wiring| {
        node = Some(build(wiring));
        |_: &mut Tick| {}
    })?;
    node.ok_or_else(|| GraphError::DuplicateNode(name.to_owned()))
}
