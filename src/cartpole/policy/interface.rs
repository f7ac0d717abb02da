//! The interface of a policy.

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
/// [`CartPole::with_policy`](crate::cartpole::CartPole::with_policy), which
/// shows one.
pub trait Policy: Send {
    /// Its name.
    fn name(&self) -> &str;

    /// The action for `observation`. One that is not finite ends the run with
    /// a fault.
    fn act(&mut self, observation: &Observation) -> Action;

    /// Swaps the policy for the one that `name` names, between two decisions;
    /// returns what it was before.
    ///
    /// # Errors
    /// Why not: a policy is what it is, unless it is
    /// [`SwappablePolicy`](crate::cartpole::policy::SwappablePolicy).
    fn swap(&mut self, name: &str) -> Result<String, String> {
        let _ = name;
        Err(format!("the {} policy cannot be swapped", self.name()))
    }

    /// Begins anew, as it was when it was made.
    ///
    /// # Errors
    /// Why it cannot: unless a policy knows better, it does not know how.
    fn restart(&mut self) -> Result<(), String> {
        Err(format!("the {} policy cannot begin anew", self.name()))
    }
}
