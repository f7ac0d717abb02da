//! Policies: from an observation to an action.
//!
//! A policy sees messages and nothing else, so any of these can be put behind
//! the same node. A [`PolicySpec`] names one: built in, or in a file.

mod cache;
mod constant;
mod delayed;
mod digest;
mod feedback;
mod file;
mod kind;
mod lqr;
mod network;
mod onnx;
mod random;
mod riccati;
mod scripted;
mod spec;
mod swappable;

pub use cache::PolicyCache;
pub use constant::Zero;
pub use delayed::DelayedPolicy;
pub use digest::Digest;
pub use file::{LARGEST_FILE, PolicyFile};
pub use kind::{PolicyKind, UnknownPolicy};
pub use lqr::{Lqr, LqrError};
pub use network::{LARGEST_WIDTH, Mlp, Network, WeightsError, read_weights};
pub use onnx::{OnnxError, RUNS_ONNX};
pub use random::Random;
pub use scripted::Scripted;
pub use spec::{LoadedPolicy, PolicyContext, PolicyError, PolicyErrorKind, PolicySpec};
pub use swappable::SwappablePolicy;

use crate::cartpole::{Action, Observation};

/// Decides what to do about an observation.
///
/// ```
/// use ratelab::cartpole::Plant;
/// use ratelab::policy::{Policy, Scripted};
///
/// let mut plant = Plant::new(0)?;
/// for _ in 0..500 {
///     // One loop, in lockstep: what a graph of nodes is not.
///     plant.step(Scripted.act(&plant.observe()));
/// }
/// assert_eq!(plant.fall(), None);
/// # Ok::<(), ratelab::cartpole::PlantError>(())
/// ```
///
/// One of your own goes behind the policy node with
/// [`Experiment::with_policy`](crate::experiment::Experiment::with_policy), which
/// shows one.
pub trait Policy: Send {
    /// What it is called.
    fn name(&self) -> &str;

    /// The action for `observation`. One that is not finite ends the run with
    /// a fault.
    fn act(&mut self, observation: &Observation) -> Action;

    /// Swaps the policy for the one that `name` names, between two decisions;
    /// returns what it was before.
    ///
    /// # Errors
    /// Why not: a policy is what it is, unless it is [`SwappablePolicy`].
    fn swap(&mut self, name: &str) -> Result<String, String> {
        let _ = name;
        Err(format!("the {} policy cannot be swapped", self.name()))
    }
}
