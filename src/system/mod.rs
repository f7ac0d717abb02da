//! A robot, or any other graph, as a value that every command works on.
//!
//! A [`System`] builds its graph and describes what there is to see of it. Runs,
//! sweeps, recordings and dashboards know this trait and no robot.
//!
//! ```
//! use std::sync::Arc;
//! use ratelab::experiment::{Config, Experiment};
//! use ratelab::runtime::{END, GO_ON};
//! use ratelab::system::{BuildError, Builder, System};
//!
//! /// A counter, and somebody who looks at it now and then.
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
mod knob_text;
mod picture;
mod setup;
mod signal;
mod table;
mod verdict;
mod world;

use std::path::PathBuf;

use thiserror::Error;

pub use age_limits::AgeLimits;
pub use alias::Alias;
pub(crate) use builder::Built;
pub use builder::{Builder, WORLD};
pub use knob_text::{KnobText, KnobTextError};
pub use picture::{Picture, Shape, Style};
pub use setup::Setup;
pub use signal::{Final, Signal};
pub use table::Table;
pub use verdict::{Verdict, VerdictKind};
pub use world::{SharedWorld, StepMs, World, WorldError, WorldKind};

use crate::runtime::{ClockExit, GraphError, HzError, Time};

/// What a program needs to know of a robot, or of any other graph, to run it,
/// show it, record it, and run a recording of it again.
pub trait System: Send + Sync + 'static {
    /// Its name, such as `drone`. Recordings carry it.
    fn name(&self) -> &'static str;

    /// What computes its plant, with the version, such as `MuJoCo 3.9.0`: another one
    /// may compute other bits. Recordings carry it.
    fn engine(&self) -> Option<String> {
        None
    }

    /// Adds its nodes and topics to an empty graph. Called once for every run;
    /// for the same [`Setup`] it builds the same graph.
    ///
    /// # Errors
    /// [`BuildError`] if the graph cannot be built as asked.
    fn build(&self, builder: &mut Builder<'_>) -> Result<(), BuildError>;

    /// Names of its own for some knobs, such as `control-hz` for `rate policy`.
    fn aliases(&self) -> &'static [Alias] {
        &[]
    }

    /// A knob that breaks it, as text, such as `control-hz 5`: what `--break` sets.
    fn broken(&self) -> Option<&'static str> {
        None
    }

    /// The text of a message to `node` in the form in which it is recorded: one
    /// that means the same whenever the run is executed again, such as a file
    /// with the digest of its content. What the node will need is loaded here,
    /// not on its thread. `seed` and `setup` are those of the run.
    ///
    /// # Errors
    /// Why the node would refuse the message, with what to try.
    fn resolve(&self, seed: u64, setup: &Setup, node: &str, text: &str) -> Result<String, String> {
        let _ = (seed, setup, node);
        Ok(text.to_owned())
    }

    /// The file that a message to `node` names, if it names one: no output of the
    /// command may replace it.
    fn file(&self, node: &str, text: &str) -> Option<PathBuf> {
        let _ = (node, text);
        None
    }

    /// What is worth plotting, the most important first.
    fn signals(&self) -> &'static [Signal] {
        &[]
    }

    /// The latency that matters, as a node and the name of its meter. What it measures
    /// is how old the [`origin`](crate::runtime::Message::origin) of each message of
    /// [`state`](Self::state) is when that is published, so that it can be read back
    /// from a recording.
    fn latency(&self) -> Option<(&'static str, &'static str)> {
        None
    }

    /// The topic whose messages are the steps of the plant: a row of a table, a
    /// picture and a verdict come from each.
    fn state(&self) -> Option<&'static str> {
        None
    }

    /// How the messages of [`state`](Self::state) are written as a table, if not as
    /// run time and their numbers.
    fn table(&self) -> Option<Table> {
        None
    }

    /// What became of a run that stopped for the reason `exit` at run time `at`.
    /// `state` is the newest message of [`state`](Self::state).
    fn verdict(&self, exit: &ClockExit, at: Time, state: Option<&[f64]>) -> Verdict {
        let _ = state;
        Verdict::of_exit(exit, at)
    }

    /// Why a run with `setup` is lost at any rate, if it is known to be: a policy
    /// that does nothing, say.
    fn lost_anyway(&self, setup: &Setup) -> Option<String> {
        let _ = setup;
        None
    }

    /// How old a push may be on average in a run with `setup`. It may take a while:
    /// callers keep it for as long as the setup stays.
    fn age_limits(&self, setup: &Setup) -> AgeLimits {
        let _ = setup;
        AgeLimits::default()
    }

    /// Every [`VerdictKind`] that [`verdict`](Self::verdict) gives, so that it can
    /// be read back from a recording. The first is that of a run that went well.
    fn verdicts(&self) -> &'static [&'static VerdictKind] {
        VerdictKind::OF_EXITS
    }

    /// Figures of the newest message of [`state`](Self::state) at the end of a run.
    fn finals(&self, state: &[f64]) -> Vec<Final> {
        let _ = state;
        Vec::new()
    }

    /// What the plant looks like, from the newest message of
    /// [`state`](Self::state).
    fn picture(&self, state: &[f64]) -> Option<Picture> {
        let _ = state;
        None
    }
}

/// A graph that cannot be built as asked.
#[derive(Debug, Error)]
pub enum BuildError {
    /// A setting that the system does not take, with what to try.
    #[error("{0}")]
    Setting(String),
    /// Two nodes or two topics of one name.
    #[error(transparent)]
    Graph(#[from] GraphError),
    /// A rate of the system's own that is none.
    #[error(transparent)]
    Rate(#[from] HzError),
    /// Something that the system needs and does not have.
    #[error(transparent)]
    Other(Box<dyn std::error::Error + Send + Sync>),
}
