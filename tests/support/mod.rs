//! What tests of the library begin with: its names, short ones for its values, and runs of the
//! cart-pole with all their messages.
#![allow(dead_code)] // Each test uses its own part.

mod figures;
mod graph_files;
mod graphs;
pub mod specs;

pub use std::{sync::Arc, time::Duration};

pub use ratelab::*;
pub use ratelab_cart_pole::{policy::*, *};
pub use ratelab_experiment::*;
pub use ratelab_metrics::*;
pub use ratelab_re_execution::*;
pub use ratelab_real_clock::*;
pub use ratelab_system::*;

pub use self::{figures::*, graph_files::*, graphs::*};

/// The number in the variable `name` of the environment, or the `usual` one.
pub fn number<T: std::str::FromStr>(name: &str, usual: T) -> T {
    let set = std::env::var(name).ok().and_then(|text| text.parse().ok());
    set.unwrap_or(usual)
}

/// The cart-pole.
pub fn cart_pole() -> Arc<CartPole> {
    Arc::default()
}

/// A policy that answers by a function.
#[derive(Clone)]
struct Own<F>(F);

impl<F: FnMut(&Observation) -> f32 + Send> Policy for Own<F> {
    fn name(&self) -> &str {
        "own"
    }

    fn act(&mut self, seen: &Observation) -> Action {
        Action((self.0)(seen))
    }
}

/// The cart-pole with a policy that answers by `act`.
pub fn with_policy(
    act: impl FnMut(&Observation) -> f32 + Clone + Send + Sync + 'static,
) -> Arc<CartPole> {
    let make = move |_| Box::new(Own(act.clone())) as Box<dyn Policy>;
    Arc::new(CartPole::with_policy(make))
}

/// The policy called `name`, as the policy node has it.
pub fn policy(name: &str) -> Box<dyn Policy> {
    let spec = name.parse().expect(name);
    Box::new(started(&spec, None).expect(name))
}

/// The policy of `spec` for chunks of so many actions, or for single ones.
pub fn started(spec: &PolicySpec, chunk: Option<usize>) -> Result<SwappablePolicy, PolicyError> {
    let context = PolicyContext {
        seed: 0,
        control_hz: hz(CONTROL_HZ),
        chunk,
    };
    SwappablePolicy::new(spec, PolicyCache::default(), context, None)
}

/// Milliseconds.
pub fn ms(ms: u64) -> Duration {
    Duration::from_millis(ms)
}

/// The run time of so many milliseconds.
pub fn at_ms(milliseconds: u64) -> Time {
    Time::ZERO + ms(milliseconds)
}

/// A run of the cart-pole, of ten seconds in virtual time, with knobs that are set before or turned
/// at a run time (s), such as `control-hz 5; 2 crash sensor`. Others: `real` clock, `own` world,
/// `seed N`, `until S`.
pub fn config(run: &str) -> Config {
    let mut config = Config::default();
    for text in run
        .split(';')
        .map(str::trim)
        .filter(|text| !text.is_empty())
    {
        let (word, value) = text.split_once(' ').unwrap_or((text, ""));
        match word {
            "real" => config.clock = ClockKind::Real,
            "own" => config.world = WorldKind::OWN,
            "seed" => config.seed = value.parse().expect(text),
            "until" => config.end = value.parse().map_or(Time::MAX, secs),
            time if time.parse::<f64>().is_ok() => {
                let knobs = CartPole::KNOBS.parse_list(text);
                config.knobs.extend(knobs.expect(text));
            }
            _ => config
                .setup
                .extend(CartPole::KNOBS.parse(text).expect(text)),
        }
    }
    config
}

/// One in a world that does not wait.
pub fn own(seed: u64, run: &str) -> Config {
    config(&format!("own; seed {seed}; {run}"))
}

/// The knob `text`, or why it is none.
pub fn checked_knob(text: &str) -> Result<Knob, String> {
    text.parse::<Knob>().map_err(|error| error.to_string())
}

/// A knob with a valid value.
pub fn knob(text: &str) -> Knob {
    checked_knob(text).expect(text)
}

/// A system with the graph that `build` adds.
pub fn system(
    build: impl Fn(&mut Builder<'_>) -> Result<(), BuildError> + Send + Sync + 'static,
) -> Arc<dyn System> {
    Arc::new(LibraryGraph::new("made", build))
}

/// The cart-pole, ready to run.
pub fn experiment(config: &Config) -> Experiment {
    Experiment::new(cart_pole(), config).expect("experiment")
}

/// Runs `system`.
pub fn run_of(system: Arc<dyn System>, config: &Config) -> Summary {
    let experiment = Experiment::new(system, config).expect("experiment");
    experiment.run().expect("run")
}

/// Runs the cart-pole.
pub fn run(config: &Config) -> Summary {
    run_of(cart_pole(), config)
}

/// The error for an invalid run of `system`.
pub fn refusal_of(system: Arc<dyn System>, config: &Config) -> String {
    let refused = Experiment::new(system, config).err();
    refused.expect("no experiment").to_string()
}

/// The error for an invalid run of the cart-pole.
pub fn refusal(config: &Config) -> String {
    refusal_of(cart_pole(), config)
}

/// Every message of a run, and its summary.
pub struct RunBytes {
    pub summary: Summary,
    pub observations: Vec<Message<Observation>>,
    pub actions: Vec<Message<Action>>,
    pub steps: Vec<Message<ControlStep>>,
}

impl RunBytes {
    /// All messages as bytes, in the format of the reference hashes; see `tests/golden/honest.py`.
    pub fn bytes(&self) -> Vec<u8> {
        self.bytes_with(&[])
    }

    /// The same with the bytes of `chunks` where `tests/golden/chunks.py` has them.
    pub fn bytes_with(&self, chunks: &[u8]) -> Vec<u8> {
        let observations = self.observations.iter().flat_map(|message| {
            let values = message.data.to_array().map(f32::to_le_bytes);
            stamped(message, values.as_flattened())
        });
        let actions = self
            .actions
            .iter()
            .flat_map(|message| stamped(message, &message.data.0.to_le_bytes()));
        let steps = self.steps.iter().flat_map(|message| {
            let step = message.data.step.to_le_bytes();
            stamped(message, &[&step[..], &state_bytes(&message.data)].concat())
        });
        observations
            .chain(chunks.iter().copied())
            .chain(actions)
            .chain(steps)
            .collect()
    }
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
    let taps = experiment.taps();
    let observations = taps.messages(OBS, ROOM).expect(OBS);
    let actions = taps.messages(ACTION, ROOM).expect(ACTION);
    let steps = taps.messages(STATE, ROOM).expect(STATE);
    RunBytes {
        summary: experiment.run().expect("run"),
        observations: tapped(&observations),
        actions: tapped(&actions),
        steps: tapped(&steps),
    }
}

/// A control step in the format of the reference hashes; see `tests/golden/reference.py`.
pub fn step_bytes(message: &Message<ControlStep>) -> Vec<u8> {
    let head = [message.data.step, message.stamp.as_nanos()].map(u64::to_le_bytes);
    [head.as_flattened(), &state_bytes(&message.data)].concat()
}

/// What a control step says of the plant, in the format of the reference hashes.
fn state_bytes(step: &ControlStep) -> Vec<u8> {
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
