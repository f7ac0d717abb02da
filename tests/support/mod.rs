//! Shared helpers: short names, nodes that record their ticks, and a run with all its
//! messages.
#![allow(dead_code)] // Each test uses its own part.

mod graphs;
pub mod specs;

use std::sync::Arc;

use ratelab::{Knob, Message, Payload, TimedKnob};
use ratelab_account::{Tap, TapMessage};
use ratelab_cart_pole::{
    ACTION, Action, CONTROL_HZ, CartPole, ControlStep, OBS, Observation, POLICY, STATE,
    policy::{Policy, PolicyCache, PolicyContext, SwappablePolicy},
};
use ratelab_effects::checked;
use ratelab_study::{
    experiment::{Config, Experiment, Summary},
    system::WorldKind,
};

pub use graphs::*;

/// The cart-pole.
pub fn cart_pole() -> Arc<CartPole> {
    Arc::default()
}

/// The cart-pole with a custom policy.
pub fn with_policy<P: Policy + Clone + Sync + 'static>(policy: P) -> Arc<CartPole> {
    let make = move |_| Box::new(policy.clone()) as Box<dyn Policy>;
    Arc::new(CartPole::with_policy(make))
}

/// The policy of `config`, as the policy node has it.
pub fn policy(config: &Config) -> Box<dyn Policy> {
    let spec = config.setup.message(POLICY).unwrap_or("scripted");
    let spec = spec.parse().expect("a policy");
    let control_hz = config.setup.rate(POLICY).unwrap_or(hz(CONTROL_HZ));
    let seed = config.seed;
    let context = PolicyContext { seed, control_hz };
    let policy = SwappablePolicy::new(&spec, PolicyCache::default(), context);
    Box::new(policy.expect("a policy"))
}

/// Ten seconds of the cart-pole, set up with knobs such as `control-hz 5`.
pub fn config(setup: &str) -> Config {
    CartPole::config(setup).expect(setup)
}

/// The knob `text`, or why it is none.
pub fn checked_knob(text: &str) -> Result<Knob, String> {
    let knob = text.parse::<Knob>().map_err(|error| error.to_string());
    knob.and_then(checked)
}

/// A knob with a valid value.
pub fn knob(text: &str) -> Knob {
    checked_knob(text).expect(text)
}

/// Timed knobs of the cart-pole, one a line.
pub fn knobs(list: &str) -> Vec<TimedKnob> {
    CartPole::KNOBS.parse_list(list).expect(list)
}

/// `config` with these knobs, too.
pub fn with(knobs: &[&str], mut config: Config) -> Config {
    config.setup.extend(knobs.iter().map(|text| knob(text)));
    config
}

/// Ten seconds of the cart-pole in a world that does not wait.
pub fn own(seed: u64) -> Config {
    Config {
        seed,
        world: WorldKind::OWN,
        ..Config::default()
    }
}

/// The cart-pole, ready to run.
pub fn experiment(config: &Config) -> Experiment {
    Experiment::new(cart_pole(), config).expect("experiment")
}

/// Runs the cart-pole.
pub fn run(config: &Config) -> Summary {
    experiment(config).run().expect("run")
}

/// The error for an invalid run of the cart-pole.
pub fn refusal(config: &Config) -> String {
    let refused = Experiment::new(cart_pole(), config).err();
    refused.expect("no experiment").to_string()
}

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
        message_bytes(&self.observations, &self.actions, &self.steps)
    }
}

/// All messages as bytes, to be compared between runs.
pub fn message_bytes(
    observations: &[Message<Observation>],
    actions: &[Message<Action>],
    steps: &[Message<ControlStep>],
) -> Vec<u8> {
    let observations = observations.iter().flat_map(|message| {
        let values = message.data.to_array().map(f32::to_le_bytes);
        stamped(message, values.as_flattened())
    });
    let actions = actions
        .iter()
        .flat_map(|message| stamped(message, &message.data.0.to_le_bytes()));
    let steps = steps.iter().flat_map(step_bytes);
    observations.chain(actions).chain(steps).collect()
}

/// A message as bytes: time, number, time of the sensing, and its payload.
pub fn stamped<T>(message: &Message<T>, payload: &[u8]) -> Vec<u8> {
    let origin = message.origin.map_or(u64::MAX, |origin| origin.as_nanos());
    let head = [message.stamp.as_nanos(), message.seq, origin].map(u64::to_le_bytes);
    [head.as_flattened(), payload].concat()
}

/// Runs the cart-pole with a tap on every topic.
pub fn run_bytes(config: &Config) -> RunBytes {
    collect(experiment(config))
}

/// Runs an experiment with the cart-pole, with a tap on every topic.
pub fn collect(experiment: Experiment) -> RunBytes {
    let observations = tap(&experiment, OBS);
    let actions = tap(&experiment, ACTION);
    let steps = tap(&experiment, STATE);
    std::thread::scope(|scope| {
        let observations = scope.spawn(|| messages_of(&observations));
        let actions = scope.spawn(|| messages_of(&actions));
        let steps = scope.spawn(|| messages_of(&steps));
        RunBytes {
            summary: experiment.run().expect("run"),
            observations: observations.join().expect("collected"),
            actions: actions.join().expect("collected"),
            steps: steps.join().expect("collected"),
        }
    })
}

fn tap<T: Payload>(experiment: &Experiment, topic: &str) -> Tap<TapMessage<T>> {
    experiment.taps().messages(topic, 4_096).expect(topic)
}

/// All messages of a tap until its topic is gone.
pub fn messages_of<T>(tap: &Tap<TapMessage<T>>) -> Vec<Message<T>> {
    tap.items().iter().map(|tapped| tapped.message).collect()
}

/// A control step in the format of the reference hashes; see `tests/golden/reference.py`.
pub fn step_bytes(message: &Message<ControlStep>) -> Vec<u8> {
    let head = [message.data.step, message.stamp.as_nanos()].map(u64::to_le_bytes);
    [head.as_flattened(), &state_bytes(&message.data)].concat()
}

/// What a control step says of the plant, in the format of the reference hashes.
pub fn state_bytes(step: &ControlStep) -> Vec<u8> {
    let latency = step.latency.map_or(-1, |latency| latency.as_nanos() as i64);
    let seen = step.observation.to_array().map(f32::to_le_bytes);
    let state = [step.qpos, step.qvel].concat();
    let state: Vec<u8> = state.into_iter().flat_map(f64::to_le_bytes).collect();
    let (action, latency) = (step.action.0.to_le_bytes(), latency.to_le_bytes());
    [seen.as_flattened(), &action, &latency, &state].concat()
}

/// The hash (64 bits) in the reference data.
pub fn fnv1a64(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

/// The figures of the messages of a run, with their names in the reference data.
pub fn traffic(summary: &Summary) -> [(&'static str, String); 7] {
    let [obs, action] = [OBS, ACTION].map(|name| summary.topic(name).expect("a topic"));
    let latency = &summary.latency;
    [
        ("steps", summary.steps.to_string()),
        ("obs_published", obs.published.to_string()),
        ("obs_dropped", obs.dropped().to_string()),
        ("action_published", action.published.to_string()),
        ("action_dropped", action.dropped().to_string()),
        ("latency_count", latency.count().to_string()),
        ("latency_sum_ns", latency.sum().as_nanos().to_string()),
    ]
}
