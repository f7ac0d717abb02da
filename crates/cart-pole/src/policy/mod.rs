//! Policies: from an observation to an action.
//!
//! A policy depends on messages only, so any of these can run in the same node. A
//! [`PolicySpec`] names one: built in, or in a file.

mod built_in;
mod cache;
mod interface;
mod lqr;
mod rows;
mod spec;
mod swappable;
mod terms;

pub use built_in::{PolicyKind, Scripted, UnknownPolicy};
pub(crate) use built_in::{Random, Zero};
pub use cache::PolicyCache;
pub use interface::Policy;
pub use lqr::{Lqr, LqrError};
pub use ratelab_policy::{
    LARGEST_FILE, Mlp, Moment, PolicyContext, PolicyError, PolicyFault, PolicyFile, ProgramError,
    ProgramKind, RUNS_ONNX, WeightsError, end_programs, read_weights,
};
pub use spec::{LoadedPolicy, PolicySpec};
pub use swappable::SwappablePolicy;
pub use terms::CartTerms;
