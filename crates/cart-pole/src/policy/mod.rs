//! Policies: from an observation to an action.
//!
//! A policy depends on messages only, so any of these can run in the same node. A
//! [`PolicySpec`] names one: built in, or in a file.

mod built_in;
mod cache;
mod error;
mod file;
mod format;
mod interface;
mod lqr;
mod network;
mod onnx;
mod program;
mod spec;
mod swappable;

pub use built_in::{PolicyKind, Scripted, UnknownPolicy};
pub(crate) use built_in::{Random, Zero};
pub use cache::PolicyCache;
pub use error::{PolicyError, PolicyFault};
pub use file::PolicyFile;
pub use format::ProgramKind;
pub use interface::{Moment, Policy, PolicyContext};
pub use lqr::{Lqr, LqrError};
pub use network::{Mlp, WeightsError, read_weights};
pub use onnx::RUNS_ONNX;
pub use program::{ProgramError, end_programs};
pub use spec::{LoadedPolicy, PolicySpec};
pub use swappable::SwappablePolicy;

/// The largest file accepted as a policy (bytes): 16 MiB, many times the size of a
/// network that can decide a thousand times a second.
pub const LARGEST_FILE: u64 = 16 << 20;
