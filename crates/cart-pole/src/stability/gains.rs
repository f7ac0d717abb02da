//! The policies covered by linear theory.

use ratelab::Hz;
use thiserror::Error;

use crate::policy::{Lqr, LqrError, PolicyKind, PolicySpec, Scripted};

/// The reason why linear theory does not apply to a policy.
#[derive(Clone, Debug, Error)]
pub enum NoTheory {
    /// It ignores the state of the plant.
    #[error("the policy {0} does not answer to readings: their age is nothing to it")]
    Blind(PolicyKind),
    /// It is a network.
    #[error("the network {0} has no gains: measure its limit by a sweep of delays")]
    Network(String),
    /// Its gains could not be computed.
    #[error(transparent)]
    Lqr(#[from] LqrError),
}

/// The gains of a policy with the initial control rate `control`, in the order of the
/// plant's state: cart position (1/m), pole angle (1/rad), cart velocity (s/m), pole
/// velocity (s/rad).
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
