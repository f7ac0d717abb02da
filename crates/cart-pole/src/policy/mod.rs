//! Policies: from an observation to an action.
//!
//! A policy depends on messages only, so any of these can run in the same node. A
//! [`PolicySpec`] names one: built in, or in a file.

mod cache;
mod constant;
mod context;
mod error;
mod file;
mod interface;
mod kind;
mod lqr;
mod network;
mod onnx;
mod program;
mod random;
mod scripted;
mod spec;
mod swappable;

pub use cache::PolicyCache;
pub use constant::Zero;
pub use context::PolicyContext;
pub use error::PolicyError;
pub use file::PolicyFile;
pub use interface::{Moment, Policy};
pub use kind::{PolicyKind, UnknownPolicy};
pub use lqr::{Lqr, LqrError};
pub use network::{LARGEST_WIDTH, Mlp, Network, read_weights};
pub use onnx::RUNS_ONNX;
pub use program::end_programs;
pub use random::Random;
pub use scripted::Scripted;
pub use spec::{LoadedPolicy, PolicySpec};
pub use swappable::SwappablePolicy;

pub use ratelab_effects::Digest;

/// The largest file accepted as a policy (bytes): 16 MiB, many times the size of a
/// network that can decide a thousand times a second.
pub const LARGEST_FILE: u64 = 16 << 20;
