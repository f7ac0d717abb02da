//! One run as a value: configuration in, summary out. Many of them are a
//! [`sweep`].
//!
//! ```
//! use ratelab::experiment::{Config, Experiment, Verdict};
//! use ratelab::runtime::Hz;
//!
//! let config = Config { control_hz: Hz::new(5.0)?, ..Config::default() };
//! let summary = Experiment::new(&config)?.run()?;
//! assert!(matches!(summary.verdict, Verdict::PoleFell { .. }));
//! assert_eq!(summary.steps, 43);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod config;
mod knob;
mod summary;
pub mod sweep;
mod taps;

use std::time::Instant;

use crossbeam_channel::Sender;

pub use config::Config;
pub use knob::{Knob, KnobError, TimedKnob, parse_knobs};
pub use summary::{NodeSummary, RunEnd, Summary, TopicSummary, Verdict};
pub use taps::Taps;

use crate::{
    cartpole::{
        ACTUATOR, Action, Actuator, CONTROL_HZ, ControlStep, Observation, POLICY, Plant,
        PlantError, PolicyNode, SENSE_TO_ACT, SENSOR, Sensor, SharedPlant,
    },
    policy::{DelayedPolicy, Policy, PolicyCache, PolicyError, SwappablePolicy},
    runtime::{
        Command, Depth, Fault, Graph, GraphError, Hz, Inbox, Observer, RealClock, TimedCommand,
        Topic, clock,
    },
};

/// A control rate at which the scripted policy loses the pole, for every seed
/// (Hz).
pub const BROKEN_HZ: f64 = 5.0;

/// Name of the topic from sensor to policy.
pub const OBS: &str = "/obs";

/// Name of the topic from policy to actuator.
pub const ACTION: &str = "/action";

/// Name of the topic on which the actuator tells what each step came to.
pub const STATE: &str = "/state";

/// An experiment that cannot be set up.
#[derive(Debug, thiserror::Error)]
pub enum SetupError {
    /// The plant cannot be made.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// The graph cannot be built.
    #[error(transparent)]
    Graph(#[from] GraphError),
    /// The policy cannot be had.
    #[error(transparent)]
    Policy(#[from] PolicyError),
}

/// The cart-pole graph, ready to run once.
///
/// ```
/// use ratelab::cartpole::{Action, Observation};
/// use ratelab::experiment::{Config, Experiment, Verdict};
/// use ratelab::policy::Policy;
///
/// /// Pushes with all it has to where the pole leans.
/// struct BangBang;
///
/// impl Policy for BangBang {
///     fn name(&self) -> &str {
///         "bang-bang"
///     }
///
///     fn act(&mut self, observation: &Observation) -> Action {
///         Action(observation.sin_theta.signum())
///     }
/// }
///
/// let experiment = Experiment::with_policy(&Config::default(), Box::new(BangBang))?;
/// let summary = experiment.run()?;
/// println!("{}", summary.verdict);
/// assert!(!summary.verdict.balanced());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Experiment {
    config: Config,
    graph: Graph,
    plant: SharedPlant,
    topics: Topics,
    commands: Sender<Command>,
    inbox: Inbox,
}

#[derive(Clone)]
struct Topics {
    observations: Topic<Observation>,
    actions: Topic<Action>,
    steps: Topic<ControlStep>,
}

impl Experiment {
    /// Builds sensor, policy and actuator around a plant.
    ///
    /// # Errors
    /// [`SetupError`] if the plant or the graph cannot be made, or a policy cannot
    /// be had.
    pub fn new(config: &Config) -> Result<Self, SetupError> {
        Self::with_cache(config, PolicyCache::default())
    }

    /// The same with policies that were read before.
    ///
    /// # Errors
    /// [`SetupError`] as for [`new`](Self::new).
    pub fn with_cache(config: &Config, cache: PolicyCache) -> Result<Self, SetupError> {
        for policy in config.knob_policies() {
            // What cannot be had later is said now.
            cache.fetch(policy)?.policy(config.policy_context())?;
        }
        let policy = SwappablePolicy::new(&config.policy, cache, config.policy_context())?;
        Self::with_policy(config, Box::new(policy))
    }

    /// The same with a policy of the caller's own behind the policy node.
    ///
    /// # Errors
    /// [`SetupError`] if the plant or the graph cannot be made.
    pub fn with_policy(config: &Config, policy: Box<dyn Policy>) -> Result<Self, SetupError> {
        let plant = SharedPlant::new(Plant::new(config.seed)?);
        let topics = Topics {
            observations: Topic::new(OBS, config.queue_depth),
            actions: Topic::new(ACTION, config.queue_depth),
            steps: Topic::new(STATE, Depth::ONE),
        };
        let graph = build(config, policy, &plant, &topics)?;
        let timed = config.knobs.iter().flat_map(TimedKnob::commands).collect();
        let (commands, inbox) = Inbox::new(timed);
        Ok(Self {
            config: config.clone(),
            graph,
            plant,
            topics,
            commands,
            inbox,
        })
    }

    /// Where commands for the running graph go.
    pub fn commands(&self) -> Sender<Command> {
        self.commands.clone()
    }

    /// Reads the graph while it runs.
    pub fn observer(&self) -> Observer {
        self.graph.observer()
    }

    /// Taps the graph, now and while it runs.
    pub fn taps(&self) -> Taps {
        Taps::new(self.graph.tap_handle(), self.topics.clone())
    }

    /// Gives `commands` when the run comes to their times, beside the knobs of
    /// its configuration.
    pub fn schedule(&mut self, commands: Vec<TimedCommand>) {
        self.inbox.schedule(commands);
    }

    /// Runs to the end: of the time, of the pole's luck, or by command. All
    /// taps end with it.
    ///
    /// # Errors
    /// [`Fault`] if a node failed.
    pub fn run(self) -> Result<Summary, Fault> {
        self.run_with(&mut RealClock::default())
    }

    /// The same with a real clock of the caller's own, for while the run is under
    /// it: one that asked for real-time scheduling, say.
    ///
    /// # Errors
    /// [`Fault`] if a node failed.
    pub fn run_with(self, real: &mut RealClock) -> Result<Summary, Fault> {
        let Self {
            config,
            mut graph,
            plant,
            topics,
            commands,
            mut inbox,
        } = self;
        // Only those who asked for a sender can end a pause.
        drop((commands, topics));
        let observer = graph.observer();
        let began = Instant::now();
        let end = clock::run(&mut graph, &mut inbox, config.end, config.clock, real);
        let wall = began.elapsed();
        // Taps end with the topics that the nodes hold.
        drop(graph);
        let exit = end?;
        Ok(Summary::new(&config, &exit, &observer, &plant.lock(), wall))
    }
}

/// Wires sensor → `/obs` → policy → `/action` → actuator.
fn build(
    config: &Config,
    policy: Box<dyn Policy>,
    plant: &SharedPlant,
    topics: &Topics,
) -> Result<Graph, GraphError> {
    let mut graph = Graph::new();
    graph.set_clock(config.clock);
    graph.set_speed(config.speed);
    graph.node(SENSOR, config.sensor_hz, 0, |wiring| Sensor {
        plant: plant.clone(),
        observations: wiring.publisher(&topics.observations),
    })?;
    let policy = match config.think {
        time if time.is_zero() => policy,
        time => Box::new(DelayedPolicy::new(policy, time)),
    };
    graph.node(POLICY, config.control_hz, 1, |wiring| PolicyNode {
        policy,
        observations: wiring.subscription(&topics.observations),
        actions: wiring.publisher(&topics.actions),
    })?;
    graph.node(ACTUATOR, actuator_hz(), 2, |wiring| Actuator {
        plant: plant.clone(),
        actions: wiring.subscription(&topics.actions),
        steps: wiring.publisher(&topics.steps),
        sense_to_act: wiring.meter(SENSE_TO_ACT),
    })?;
    Ok(graph)
}

/// The plant's own rate, which is not a choice.
pub(crate) fn actuator_hz() -> Hz {
    // A constant within the range of rates.
    Hz::new(CONTROL_HZ).expect("50 Hz is a rate")
}
