//! What several tests need: a run with everything it said.
#![allow(dead_code)] // Each test uses its own part.

use ratelab::{
    cartpole::{Action, ControlStep, Observation},
    experiment::{Config, Experiment, Summary},
    runtime::{Message, RealClock, Tap},
};

/// Every message of a run, and its summary.
pub struct RunBytes {
    pub summary: Summary,
    pub observations: Vec<Message<Observation>>,
    pub actions: Vec<Message<Action>>,
    pub steps: Vec<Message<ControlStep>>,
}

impl RunBytes {
    /// All messages as bytes, to be compared between runs.
    pub fn bytes(&self) -> Vec<u8> {
        let observations = self.observations.iter().flat_map(|message| {
            let values = message.data.to_array().map(f32::to_le_bytes);
            stamped(message, values.as_flattened())
        });
        let actions = self
            .actions
            .iter()
            .flat_map(|message| stamped(message, &message.data.0.to_le_bytes()));
        let steps = self.steps.iter().flat_map(step_bytes);
        observations.chain(actions).chain(steps).collect()
    }
}

fn stamped<T>(message: &Message<T>, payload: &[u8]) -> Vec<u8> {
    let origin = message.origin.map_or(u64::MAX, |origin| origin.as_nanos());
    let head = [message.stamp.as_nanos(), message.seq, origin].map(u64::to_le_bytes);
    [head.as_flattened(), payload].concat()
}

/// Runs `config` with a tap on every topic.
pub fn run_bytes(config: &Config) -> RunBytes {
    collect(Experiment::new(config).expect("experiment"))
}

/// Runs `experiment` with a tap on every topic.
pub fn collect(experiment: Experiment) -> RunBytes {
    let capacity = 16;
    let observations = experiment.tap_observations(capacity);
    let actions = experiment.tap_actions(capacity);
    let steps = experiment.tap_steps(capacity);
    std::thread::scope(|scope| {
        let observations = scope.spawn(|| all(&observations));
        let actions = scope.spawn(|| all(&actions));
        let steps = scope.spawn(|| all(&steps));
        RunBytes {
            summary: experiment.run(&mut RealClock::default()).expect("run"),
            observations: observations.join().expect("collected"),
            actions: actions.join().expect("collected"),
            steps: steps.join().expect("collected"),
        }
    })
}

fn all<T>(tap: &Tap<T>) -> Vec<Message<T>> {
    tap.messages().iter().collect()
}

/// A control step in the layout of the reference hashes; see
/// `tests/golden/reference.py`.
pub fn step_bytes(message: &Message<ControlStep>) -> Vec<u8> {
    let step = &message.data;
    let latency = step.latency.map_or(-1, |latency| latency.as_nanos() as i64);
    let mut bytes = Vec::with_capacity(80);
    bytes.extend(step.step.to_le_bytes());
    bytes.extend(message.stamp.as_nanos().to_le_bytes());
    bytes.extend(
        step.observation
            .to_array()
            .map(f32::to_le_bytes)
            .as_flattened(),
    );
    bytes.extend(step.action.0.to_le_bytes());
    bytes.extend(latency.to_le_bytes());
    bytes.extend(step.qpos.map(f64::to_le_bytes).as_flattened());
    bytes.extend(step.qvel.map(f64::to_le_bytes).as_flattened());
    bytes
}
