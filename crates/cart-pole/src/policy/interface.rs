//! The interface of a policy.

use std::sync::Arc;

use ratelab_policy::{Moment, PolicyFault};

use crate::{Action, Observation};

/// Decides on an action for each observation.
///
/// ```
/// use ratelab_cart_pole::{Plant, policy::{Policy, Scripted}};
///
/// let mut plant = Plant::new(0)?;
/// for _ in 0..500 {
///     // One loop, in lockstep, unlike a graph of nodes.
///     plant.step(Scripted.act(&plant.observe()));
/// }
/// assert_eq!(plant.fall(), None);
/// # Ok::<(), ratelab_cart_pole::PlantError>(())
/// ```
///
/// [`CartPole::with_policy`](crate::CartPole::with_policy) runs your own policy
/// in the policy node, with an example.
pub trait Policy: Send {
    /// Returns the name of the policy.
    fn name(&self) -> &str;

    /// Returns the action for `observation`. A NaN or infinite action ends the run with a fault.
    fn act(&mut self, observation: &Observation) -> Action;

    /// Returns the actions for `state` and the times after it, one for each 20 ms, of a policy that
    /// answers with chunks; `None` for one that decides on single actions. Where the plan has a
    /// model, this is the state that the model comes to.
    fn chunk_from(&mut self, state: &Observation) -> Option<Vec<f32>> {
        let _ = state;
        None
    }

    /// Makes itself ready for a run.
    ///
    /// # Errors
    /// The reason if it cannot.
    fn start(&mut self) -> Result<(), PolicyFault> {
        Ok(())
    }

    /// Hears of the tick in which it will be asked.
    fn begin(&mut self, moment: Moment) {
        let _ = moment;
    }

    /// Returns a whole chunk for `reading`, of a policy that has a model of its own.
    fn whole_chunk(&mut self, reading: &Observation) -> Option<Arc<[f32]>> {
        let _ = reading;
        None
    }

    /// Returns why it has died in this tick, and what to do, if it has: what it answered does not
    /// count.
    fn crash(&mut self) -> Option<String> {
        None
    }

    /// Replaces the policy by the one called `name`, between two decisions; returns the
    /// previous name.
    ///
    /// # Errors
    /// The reason: only a [`SwappablePolicy`](crate::policy::SwappablePolicy)
    /// can be replaced.
    fn swap(&mut self, name: &str) -> Result<String, PolicyFault> {
        let _ = name;
        Err(PolicyFault::Fixed(self.name().to_owned()))
    }

    /// Returns to the initial state.
    ///
    /// # Errors
    /// The reason: the default refuses, because the initial state is unknown.
    fn restart(&mut self) -> Result<(), PolicyFault> {
        Err(PolicyFault::NoRestart(self.name().to_owned()))
    }
}
