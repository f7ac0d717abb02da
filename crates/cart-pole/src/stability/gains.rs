//! The policies covered by linear theory.

use ratelab::Hz;

use super::error::StabilityError;
use crate::policy::{Lqr, PolicyKind, PolicySpec, Scripted};

/// The gains of a policy with the initial control rate `control`, in the order of the
/// plant's state: cart position (1/m), pole angle (1/rad), cart velocity (s/m), pole
/// velocity (s/rad).
///
/// # Errors
/// [`StabilityError`] if it is no linear feedback, with the reason.
pub fn gains(policy: &PolicySpec, control: Hz) -> Result<[f64; 4], StabilityError> {
    match policy {
        PolicySpec::BuiltIn(PolicyKind::Scripted) => Ok(Scripted::GAINS),
        PolicySpec::BuiltIn(PolicyKind::Lqr) => Ok(Lqr::at(control)?.gains()),
        PolicySpec::BuiltIn(kind @ (PolicyKind::Zero | PolicyKind::Random)) => {
            Err(StabilityError::Blind(*kind))
        }
        PolicySpec::File(_) => Err(StabilityError::Network(policy.name().to_owned())),
    }
}
