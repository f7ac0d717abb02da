//! Which policies linear theory is about.

use thiserror::Error;

use crate::{
    policy::{Lqr, LqrError, PolicyKind, PolicySpec, Scripted},
    runtime::Hz,
};

/// Linear theory has nothing to tell about a policy.
#[derive(Clone, Debug, Error)]
pub enum NoTheory {
    /// It does not look at the plant.
    #[error("the policy {0} does not answer to readings: their age is nothing to it")]
    Blind(PolicyKind),
    /// It is a network.
    #[error("the network {0} has no gains: measure what it bears by a sweep of delays")]
    Network(String),
    /// Its gains were not found.
    #[error(transparent)]
    Lqr(#[from] LqrError),
}

/// The gains of a policy that decides at `control` when the run begins, in the
/// order of the plant's state: cart position (1/m), pole angle (1/rad), cart
/// velocity (s/m), pole velocity (s/rad).
///
/// # Errors
/// [`NoTheory`] if it is no linear feedback, with the reason.
pub fn gains(policy: &PolicySpec, control: Hz) -> Result<[f64; 4], NoTheory> {
    match policy {
        PolicySpec::BuiltIn(PolicyKind::Scripted) => Ok(Scripted::GAINS),
        PolicySpec::BuiltIn(PolicyKind::Lqr) => Ok(Lqr::at(control)?.gains()),
        PolicySpec::BuiltIn(kind @ (PolicyKind::Zero | PolicyKind::Random)) => {
            Err(NoTheory::Blind(*kind))
        }
        PolicySpec::File(_) => Err(NoTheory::Network(policy.name().to_owned())),
    }
}
