//! A robot, or any other graph, as a value that every command works on.
//!
//! A [`System`] builds its graph and describes how to show it. Runs, sweeps, recordings
//! and dashboards depend on this trait only, and are independent of the robot.
//!
//! ```
//! use std::sync::Arc;
//! use ratelab::{END, GO_ON};
//! use ratelab_study::{
//!     experiment::{Config, Experiment},
//!     system::{BuildError, Builder, System},
//! };
//!
//! /// A counter with an occasional reader.
//! struct Counter;
//!
//! impl System for Counter {
//!     fn name(&self) -> &'static str {
//!         "counter"
//!     }
//!
//!     fn build(&self, builder: &mut Builder<'_>) -> Result<(), BuildError> {
//!         let count = builder.internal_topic("/count");
//!         let counted = count.clone();
//!         builder.node("counter", 10.0, 0, move |wiring| {
//!             let (count, mut number) = (wiring.publisher(&counted), 0);
//!             move |now| {
//!                 number += 1;
//!                 count.publish(number, now, None);
//!                 GO_ON
//!             }
//!         })?;
//!         builder.node("reader", 2.0, 1, move |wiring| {
//!             let mut count = wiring.subscription(&count);
//!             move |now| match count.latest(now) {
//!                 Some(message) if message.data > 20 => END,
//!                 _ => GO_ON,
//!             }
//!         })
//!     }
//! }
//!
//! let summary = Experiment::new(Arc::new(Counter), &Config::default())?.run()?;
//! assert_eq!(summary.verdict.to_string(), "ENDED at 2.000 s (by a node)");
//! assert_eq!(summary.topic("/count").dropped, 16);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod age_limits;
mod alias;
mod builder;
mod comment;
mod joints;
mod knob_text;
mod picture;
mod quadratic_cost;
mod setup;
mod signal;
mod table;
mod verdict;
mod world;

use std::path::PathBuf;

use ratelab::{ClockExit, GraphError, HzError, Time};
use thiserror::Error;

pub use age_limits::AgeLimits;
pub use alias::{Alias, paced_node};
pub use builder::{Builder, WORLD};
pub(crate) use builder::{Built, ForwardingNode, Surroundings};
pub use joints::{JointValues, Joints};
pub use knob_text::{KnobText, KnobTextError};
pub use picture::{Picture, Shape, Style};
pub use quadratic_cost::{MeanCost, QuadraticCost};
pub use setup::Setup;
pub use signal::{Final, Signal};
pub use table::StateTable;
pub use verdict::{Verdict, VerdictKind};
pub use world::{SharedWorld, StepMs, World, WorldError, WorldKind};

/// Everything a program needs to run a robot, or any other graph, to show and record it,
/// and to repeat the run of a recording.
pub trait System: Send + Sync + 'static {
    /// Name, such as `drone`. Recordings contain it.
    fn name(&self) -> &'static str;

    /// The engine of its plant, with the version, such as `MuJoCo 3.9.0`: another version
    /// may compute other bits. Recordings contain it.
    fn engine(&self) -> Option<String> {
        None
    }

    /// The text of its [graph file](crate::graph_file), if it has one. Recordings contain it.
    fn graph_file(&self) -> Option<&str> {
        None
    }

    /// Its settings. Those of a run replace them.
    fn settings(&self) -> Setup {
        Setup::default()
    }

    /// Defects of a run with `setup` that are known before it begins, each with a remedy.
    fn warnings(&self, setup: &Setup) -> Vec<String> {
        let _ = setup;
        Vec::new()
    }

    /// Adds the system's nodes and topics to an empty graph. Called once per run; builds
    /// the same graph for the same [`Setup`].
    ///
    /// # Errors
    /// [`BuildError`] if the graph cannot be built.
    fn build(&self, builder: &mut Builder<'_>) -> Result<(), BuildError>;

    /// The nodes that share something beside topics, such as the plant, under a name for
    /// the group: they run in one process.
    fn groups(&self) -> &'static [Group] {
        &[]
    }

    /// The topics whose messages are joint states for other robot software.
    fn joints(&self) -> &'static [Joints] {
        &[]
    }

    /// A knob, as text, that keeps the plant safe where an action may cease to arrive: a
    /// setting of runs in several processes. `setup` is that of the run.
    fn watchdog(&self, setup: &Setup) -> Option<String> {
        let _ = setup;
        None
    }

    /// The system's own names for some knobs, such as `control-hz` for `rate policy`.
    fn aliases(&self) -> &'static [Alias] {
        &[]
    }

    /// The function of a node in a few words that begin with the verb, such as `reads the
    /// plant`.
    fn caption(&self, node: &str) -> Option<&'static str> {
        let _ = node;
        None
    }

    /// A knob that makes runs fail, as text, such as `control-hz 5`: the setting of
    /// `--break`.
    fn broken(&self) -> Option<&'static str> {
        None
    }

    /// Returns the recordable form of a message to `node`, with the same meaning whenever
    /// the run is repeated, such as a file with the digest of its content. Loads
    /// everything that the node will need, outside of the node's thread. `seed` and
    /// `setup` are those of the run.
    ///
    /// # Errors
    /// The reason why the node would refuse the message, with a remedy.
    fn resolve(&self, seed: u64, setup: &Setup, node: &str, text: &str) -> Result<String, String> {
        let _ = (seed, setup, node);
        Ok(text.to_owned())
    }

    /// The file named by a message to `node`, if any: outputs of the command must not
    /// replace it.
    fn file(&self, node: &str, text: &str) -> Option<PathBuf> {
        let _ = (node, text);
        None
    }

    /// The signals to plot, the most important first.
    fn signals(&self) -> &'static [Signal] {
        &[]
    }

    /// The main latency, as a node and the name of its meter. It must measure the age of
    /// the [`origin`](ratelab::Message::origin) of each message of
    /// [`state`](Self::state) at its publication, so that it can be computed from a
    /// recording.
    fn latency(&self) -> Option<(&'static str, &'static str)> {
        None
    }

    /// The topics on the way of the data to the node of that latency, the sensor first; empty
    /// if the origin of each message tells it.
    fn latency_path(&self) -> &'static [&'static str] {
        &[]
    }

    /// The topic of the plant's steps: each message gives a row of a table, a picture and
    /// a verdict.
    fn state(&self) -> Option<&'static str> {
        None
    }

    /// The table format of the messages of [`state`](Self::state), if it differs from run
    /// time and numbers.
    fn table(&self) -> Option<StateTable> {
        None
    }

    /// The verdict on a run that stopped with `exit` at run time `at`. `state` is the
    /// newest message of [`state`](Self::state).
    fn verdict(&self, exit: &ClockExit, at: Time, state: Option<&[f64]>) -> Verdict {
        let _ = state;
        Verdict::of_exit(exit, at)
    }

    /// The topic with the data ages of its chains, if there are any: its newest message counts
    /// in the verdict.
    fn chains(&self) -> Option<&'static str> {
        None
    }

    /// The verdict of a run that stopped with `exit` at run time `at`, in view of the newest
    /// message of [`chains`](Self::chains). `verdict` is that without them.
    fn verdict_on_chains(
        &self,
        verdict: Verdict,
        exit: &ClockExit,
        at: Time,
        chains: Option<&[f64]>,
    ) -> Verdict {
        let _ = (exit, at, chains);
        verdict
    }

    /// A line with the data age of each chain up to run time `at`, from the newest message of
    /// [`chains`](Self::chains); `idle` are the names of the nodes that never ticked.
    fn chain_lines(&self, at: Time, chains: &[f64], idle: &[&str]) -> Vec<String> {
        let _ = (at, chains, idle);
        Vec::new()
    }

    /// The quadratic cost of its states, if it has one: it rates runs that are not lost.
    fn quadratic_cost(&self) -> Option<QuadraticCost> {
        None
    }

    /// The reason why a run with `setup` is lost at any rate, if there is one: a policy
    /// that does nothing, for example.
    fn lost_anyway(&self, setup: &Setup) -> Option<String> {
        let _ = setup;
        None
    }

    /// Limits of the mean push age in a run with `setup`. The computation may be slow:
    /// callers cache it until the setup changes.
    fn age_limits(&self, setup: &Setup) -> AgeLimits {
        let _ = setup;
        AgeLimits::default()
    }

    /// All kinds that [`verdict`](Self::verdict) returns, so that they can be read from a
    /// recording. The first is that of a successful run.
    fn verdicts(&self) -> &'static [&'static VerdictKind] {
        VerdictKind::OF_EXITS
    }

    /// Figures of the last message of [`state`](Self::state) in a run.
    fn finals(&self, state: &[f64]) -> Vec<Final> {
        let _ = state;
        Vec::new()
    }

    /// The same at run time `at`, the end of a run, for figures that change after the last
    /// message, such as an age.
    fn finals_at(&self, at: Time, state: &[f64]) -> Vec<Final> {
        let _ = at;
        self.finals(state)
    }

    /// A picture of the plant, from the newest message of [`state`](Self::state).
    fn picture(&self, state: &[f64]) -> Option<Picture> {
        let _ = state;
        None
    }
}

/// The verdict of `system` on a run that stopped with `exit` at run time `at`, from the newest
/// messages of its [states](System::state) and of its [chains](System::chains).
pub fn verdict(
    system: &dyn System,
    exit: &ClockExit,
    at: Time,
    [state, chains]: [Option<&[f64]>; 2],
) -> Verdict {
    let verdict = system.verdict(exit, at, state);
    system.verdict_on_chains(verdict, exit, at, chains)
}

/// Nodes that share something beside topics.
#[derive(Clone, Copy, Debug)]
pub struct Group {
    /// Name of the group, such as `plant`.
    pub name: &'static str,
    /// Names of its nodes. A run may lack some of them.
    pub nodes: &'static [&'static str],
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
