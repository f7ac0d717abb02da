//! Growth by linear theory for each pair of rates of the cart-pole.

use ratelab::{
    cartpole::{POLICY, SENSOR, actuator_hz},
    policy::PolicyKind,
    stability::{Rates, Stability, StabilityError},
    system::Setup,
};

use crate::error::Error;

/// The growth of a small deviation (1/s) by rates; `None` where the hyper-period is too
/// long.
#[derive(Default)]
pub struct Theory(Vec<(Rates, Option<f64>)>);

impl Theory {
    /// The growth for a run with `setup`, if the theory covers its policy.
    ///
    /// # Errors
    /// [`Error::Theory`] if the theory fails unexpectedly.
    pub fn growth(&mut self, setup: &Setup) -> Result<Option<f64>, Error> {
        let scripted = PolicyKind::Scripted.name();
        if setup
            .message(POLICY)
            .is_some_and(|policy| policy != scripted)
        {
            return Ok(None);
        }
        let rate = |node| setup.rate(node).unwrap_or(actuator_hz());
        let (sensor, control) = (rate(SENSOR), rate(POLICY));
        let rates = Rates { sensor, control };
        if let Some((_, growth)) = self.0.iter().find(|(known, _)| *known == rates) {
            return Ok(*growth);
        }
        let growth = match Stability::of(rates) {
            Ok(stability) => Some(stability.growth()),
            Err(StabilityError::Aperiodic { .. }) => None,
            Err(error) => return Err(Error::Theory(error)),
        };
        self.0.push((rates, growth));
        Ok(growth)
    }
}
