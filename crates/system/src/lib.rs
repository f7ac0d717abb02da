//! A robot, or any other graph, as a value that every command works on.
//!
//! A [`System`] builds its graph and describes how to show it. Runs, sweeps, recordings
//! and dashboards depend on this trait only, and are independent of the robot. A
//! [`graph_file`] is a system without a line of code, and a graph that a program of the library
//! builds is a system by [`LibraryGraph`].
//!
//! Stands on `ratelab` and `ratelab-metrics`; knows no robot, terminal or recording. Begin with
//! [`System`].
//!
//! ```
//! use std::sync::Arc;
//! use ratelab::{Flow, Tick};
//! use ratelab_experiment::{Config, Experiment};
//! use ratelab_system::{BuildError, Builder, System};
//!
//! /// A counter with an occasional reader.
//! struct Counter;
//!
//! impl System for Counter {
//!     fn name(&self) -> &str {
//!         "counter"
//!     }
//!
//!     fn build(&self, builder: &mut Builder<'_>) -> Result<(), BuildError> {
//!         let count = builder.internal_topic("/count");
//!         let counted = count.clone();
//!         builder.node("counter", 10.0, 0, move |wiring| {
//!             let (count, mut number) = (wiring.publisher(&counted), 0);
//!             move |tick: &mut Tick| {
//!                 number += 1;
//!                 tick.publish(&count, number);
//!             }
//!         })?;
//!         builder.node("reader", 2.0, 1, move |wiring| {
//!             let mut count = wiring.subscription(&count);
//!             move |tick: &mut Tick| match tick.read(&mut count) {
//!                 Some(message) if message.data > 20 => Flow::End,
//!                 _ => Flow::Continue,
//!             }
//!         })
//!     }
//! }
//!
//! let summary = Experiment::new(Arc::new(Counter), &Config::default())?.run()?;
//! assert_eq!(summary.verdict.to_string(), "ENDED at 2.000 s (by a node)");
//! assert_eq!(summary.topic("/count").expect("a topic").dropped(), 16);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod about;
mod age_limits;
mod alias;
mod builder;
mod chain;
mod chain_ages;
mod chain_tracker;
mod comment;
mod divider;
mod figure_limit;
pub mod file;
pub mod graph_file;
mod joints;
mod knob_text;
mod library;
pub mod measured;
pub mod names;
mod overload;
mod picture;
mod plan_bars;
mod planning;
mod plant_record;
mod quadratic_cost;
mod setup;
mod signal;
mod tally;
mod verdict;
mod world;

use std::path::PathBuf;

use ratelab::{ClockExit, GraphError, HzError, Knob, Time, Topology};
use thiserror::Error;

pub use about::{About, Group, Spoiler, StateTable};
pub use age_limits::AgeLimits;
pub use alias::Alias;
pub(crate) use builder::ForwardingNode;
pub use builder::{
    AnswersOfNodes, BuildInputs, Builder, BuiltGraph, RecordedAnswers, RecordedTopics, WORLD,
};
pub use chain::{CHAINS, DataChain, Silence, Unmatched};
pub(crate) use chain::{Limit, key};
pub(crate) use chain_ages::{ChainAges, Numbers, PEAKS, chain_fields};
pub use chain_ages::{MAX_CHAINS, is_run_time};
pub use chain_tracker::{ChainTracker, TopicChains};
pub use divider::Divider;
pub use figure_limit::{Bound, FigureLimit};
pub use joints::{JointValues, Joints};
pub use knob_text::{KnobText, KnobTextError};
pub use library::LibraryGraph;
pub use names::paced_node;
pub use overload::overload;
pub(crate) use overload::{FULL, cost_of, shortest_ms};
pub use picture::{Picture, Shape, Style};
pub use plan_bars::{BarPart, PlanBar, PlanBars};
pub use planning::{ActionPlan, Planning, PlayStep};
pub use plant_record::PlantRecord;
pub use quadratic_cost::{MeanCost, QuadraticCost};
pub use setup::Setup;
pub use signal::{Final, Signal, SignalValue};
pub use tally::{FigureValue, RunTally, SystemFigure};
pub use verdict::{Verdict, VerdictKind};
pub use world::{SharedWorld, StepMs, World, WorldError, WorldKind, depends_on_the_world};

/// Everything a program needs to run a robot, or any other graph, to show and record it,
/// and to repeat the run of a recording.
pub trait System: Send + Sync + 'static {
    /// Name, such as `drone`. Recordings contain it.
    fn name(&self) -> &str;

    /// Adds the system's nodes and topics to an empty graph. Called once per run; builds
    /// the same graph for the same [`Setup`].
    ///
    /// # Errors
    /// [`BuildError`] if the graph cannot be built.
    fn build(&self, builder: &mut Builder<'_>) -> Result<(), BuildError>;

    /// The system in the middle of this one; `None` without one. What this one does not say
    /// itself is as that one says.
    fn inner(&self) -> Option<&dyn System> {
        None
    }

    /// Its description.
    fn about(&self) -> About<'_> {
        self.inner().map(System::about).unwrap_or_default()
    }

    /// The groups of nodes that share something beside topics, such as the plant: each runs in one
    /// process.
    fn groups(&self) -> Vec<Group> {
        self.inner().map_or_else(Vec::new, System::groups)
    }

    /// The signals to plot, the most important first.
    fn signals(&self) -> Vec<Signal> {
        self.inner().map_or_else(Vec::new, System::signals)
    }

    /// The topic of the plant's steps: each message gives a row of a table, a picture and
    /// a verdict.
    fn state(&self) -> Option<&str> {
        self.inner()?.state()
    }

    /// The main latency, as a node and the name of its meter. It must measure the age of
    /// the [`origin`](ratelab::Message::origin) of each message of
    /// [`state`](Self::state) at its publication, so that it can be computed from a
    /// recording.
    fn latency(&self) -> Option<(&str, &str)> {
        self.inner()?.latency()
    }

    /// The verdict on a run that stopped with `exit` at run time `at`. `state` is the
    /// newest message of [`state`](Self::state).
    fn verdict(&self, exit: &ClockExit, at: Time, state: Option<&[f64]>) -> Verdict {
        match self.inner() {
            Some(inner) => inner.verdict(exit, at, state),
            None => Verdict::from_exit(exit, at),
        }
    }

    /// All kinds that [`verdict`](Self::verdict) returns, so that they can be read from a
    /// recording. The first is that of a successful run.
    fn verdicts(&self) -> Vec<VerdictKind> {
        let inner = self.inner().map(System::verdicts);
        inner.unwrap_or_else(|| VerdictKind::OF_EXITS.to_vec())
    }

    /// Figures of the last message of [`state`](Self::state) in a run.
    fn finals(&self, state: &[f64]) -> Vec<Final> {
        self.inner()
            .map_or_else(Vec::new, |inner| inner.finals(state))
    }

    /// The final figures at run time `at`, the end of a run: for those that change after the last
    /// message, such as an age.
    fn finals_at(&self, at: Time, state: &[f64]) -> Vec<Final> {
        let _ = at;
        self.finals(state)
    }

    /// What adds up figures of a run with `setup` beside the figures of every run; `None` without any.
    fn tally(&self, setup: &Setup) -> Option<Box<dyn RunTally>> {
        self.inner()?.tally(setup)
    }

    /// A picture of the plant, from the newest message of [`state`](Self::state).
    fn picture(&self, state: &[f64]) -> Option<Picture> {
        self.inner()?.picture(state)
    }

    /// Returns the recordable form of a message to `node`, with the same meaning whenever
    /// the run is repeated, such as a file with the digest of its content. Loads
    /// everything that the node will need, outside of the node's thread. `seed` and
    /// `setup` are those of the run.
    ///
    /// # Errors
    /// The reason why the node would refuse the message, with a remedy.
    fn resolve(&self, seed: u64, setup: &Setup, node: &str, text: &str) -> Result<String, String> {
        match self.inner() {
            Some(inner) => inner.resolve(seed, setup, node, text),
            None => Ok(text.to_owned()),
        }
    }

    /// The shortest form of a `value` of the parameter `name` of `node`.
    ///
    /// # Errors
    /// The reason why the node would refuse it, with a remedy.
    fn parameter(&self, [node, name]: [&str; 2], value: &str) -> Result<String, String> {
        match self.inner() {
            Some(inner) => inner.parameter([node, name], value),
            None => Ok(value.to_owned()),
        }
    }

    /// The file named by a message to `node`, if any: outputs of the command must not
    /// replace it.
    fn file(&self, node: &str, text: &str) -> Option<PathBuf> {
        self.inner()?.file(node, text)
    }

    /// Whether a message to `node` names a program, which runs in a process of its own: as
    /// the recordable form of the message says (see [`System::resolve`]), or the file of that name
    /// if the system `looks` at it.
    fn is_program(&self, node: &str, text: &str, looks: bool) -> bool {
        let inner = self.inner();
        inner.is_some_and(|inner| inner.is_program(node, text, looks))
    }

    /// Defects of a run with `setup` that are known before it begins, each with a remedy.
    fn warnings(&self, setup: &Setup) -> Vec<String> {
        self.inner()
            .map_or_else(Vec::new, |inner| inner.warnings(setup))
    }

    /// Nodes that are asked for more than they can do in a run with `setup`, unless
    /// [`warnings`](Self::warnings) has them. They are told before the run; in a run the parts of
    /// the age tell.
    fn overloads(&self, setup: &Setup) -> Vec<String> {
        let _ = setup;
        Vec::new()
    }

    /// The reason why a run with `setup` is lost at any rate, if there is one: a policy
    /// that does nothing, for example.
    fn lost_anyway(&self, setup: &Setup) -> Option<String> {
        self.inner()?.lost_anyway(setup)
    }

    /// Limits of the mean push age in a run with `setup`, less the part of it that plans
    /// [predicted](PlayStep::predicted). The computation may be slow:
    /// callers cache it until the setup changes.
    fn age_limits(&self, setup: &Setup) -> AgeLimits {
        let inner = self.inner().map(|inner| inner.age_limits(setup));
        inner.unwrap_or_default()
    }

    /// A knob, as text, that keeps the plant safe where an action may cease to arrive: a
    /// setting of runs in several processes. `setup` is that of the run.
    fn watchdog(&self, setup: &Setup) -> Option<String> {
        self.inner()?.watchdog(setup)
    }
}

impl dyn System + '_ {
    /// Returns `knob` in recordable form, for a run with this `seed` and `setup`: its
    /// message or its parameter resolved.
    ///
    /// # Errors
    /// The reason why the node would refuse it.
    pub fn resolved(&self, seed: u64, setup: &Setup, knob: Knob) -> Result<Knob, String> {
        match knob {
            Knob::Send { node, text } => {
                let text = self.resolve(seed, setup, &node, &text)?;
                Ok(Knob::Send { node, text })
            }
            Knob::Parameter { node, name, value } => {
                let value = self.parameter([&node, &name], &value)?;
                Ok(Knob::Parameter { node, name, value })
            }
            knob => Ok(knob),
        }
    }

    /// Its own names for some knobs.
    pub fn aliases(&self) -> &'static [Alias] {
        self.about().aliases
    }

    /// The quadratic cost of its states; `None` without one.
    pub fn quadratic_cost(&self) -> Option<QuadraticCost> {
        self.about().quadratic_cost
    }

    /// The topic with the data ages of its chains; `None` without chains.
    pub fn chains(&self) -> Option<&'static str> {
        (!self.about().chains.is_empty()).then_some(CHAINS)
    }
}

/// The topic of the states of a plant; `None` for a graph around data only.
pub fn plant(system: &dyn System) -> Option<&str> {
    let state = system.state();
    state.filter(|state| Some(*state) != system.chains())
}

/// Index of the node of `graph` with the [latency](System::latency) of `system`.
pub fn acting(system: &dyn System, graph: &Topology) -> Option<usize> {
    let (acts, _) = system.latency()?;
    graph.node(acts)
}

/// The verdict of `system` on a run that stopped with `exit` at run time `at`, from the newest
/// messages of its [states](System::state) and of its chains.
pub fn verdict(
    system: &dyn System,
    exit: &ClockExit,
    at: Time,
    [state, chains]: [Option<&[f64]>; 2],
) -> Verdict {
    let verdict = system.verdict(exit, at, state);
    if verdict.is_lost() {
        return verdict;
    }
    let over = *exit != ClockExit::Stopped;
    let mut each = system.about().chains.iter();
    let missed = each.find_map(|chain| chain.missed(at, chains, over));
    missed.map_or(verdict, |missed| Verdict::new(missed.clone(), at))
}

/// An error while building a graph.
#[derive(Debug, Error)]
pub enum BuildError {
    /// An invalid setting, with a remedy.
    #[error("{0}")]
    Setting(String),
    /// Two nodes or two topics with the same name.
    #[error(transparent)]
    Graph(#[from] GraphError),
    /// An invalid rate in the system itself.
    #[error(transparent)]
    Rate(#[from] HzError),
    /// A missing prerequisite of the system.
    #[error(transparent)]
    Other(Box<dyn std::error::Error + Send + Sync>),
}
