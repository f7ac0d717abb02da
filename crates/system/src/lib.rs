//! A robot, or any other graph, as a value that every command works on.
//!
//! A [`System`] builds its graph. A [`Judge`] says what its runs are worth, a [`RobotInfo`] what its plant
//! looks like, [`SystemKnobs`] what its knobs mean. Runs, sweeps, recordings and dashboards depend on
//! these traits only, and are independent of the robot. A
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
mod builder;
mod chain;
mod chain_ages;
mod chain_tracker;
pub mod file;
pub mod graph_file;
mod judge;
mod knob_text;
mod knobs;
pub mod measured;
pub mod names;
mod overload;
mod planning;
mod robot;
mod system;
mod world;

use ratelab::{GraphError, HzError};
use thiserror::Error;

pub use about::{About, Divider, Group, Signal, SignalValue};
pub(crate) use builder::ForwardingNode;
pub use builder::{
    AnswersOfNodes, BuildInputs, Builder, BuiltGraph, RecordedAnswers, RecordedTopics, WORLD,
};
pub use chain::{BagAges, CHAINS, DataChain, Silence, Unmatched};
pub(crate) use chain::{Limit, figure_name};
pub(crate) use chain_ages::{ChainAges, Numbers, chain_fields, peak};
pub use chain_ages::{MAX_CHAINS, is_run_time};
pub use chain_tracker::{ChainTracker, TopicChains};
pub use judge::{
    AgeLimits, Bound, FigureLimit, FigureValue, Final, Judge, MeanCost, QuadraticCost, RunTally,
    SystemFigure, Verdict, VerdictKind,
};
pub use knob_text::{KnobText, KnobTextError};
pub use knobs::{Alias, Setup, SystemKnobs};
pub use names::paced_node;
pub use overload::overload;
pub(crate) use overload::{FULL, cost_of, shortest_ms};
pub use planning::{ActionPlan, BarPart, PlanBar, PlanBars, Planning, PlayStep, Spoiler};
pub use robot::{
    GeomRecord, JointValues, Joints, Picture, PlantRecord, RobotInfo, Shape, StateTable, Style,
};
pub use system::{LibraryGraph, System, acting_node, plant_topic};
pub use world::{
    SharedWorld, StepInput, StepMs, World, WorldError, WorldKind, depends_on_the_world,
};

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
