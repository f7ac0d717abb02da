//! The age limits of a loop with the knobs in force, computed in the background.

use std::sync::Arc;

use ratelab_study::system::{AgeLimits, Setup, System};

use super::asked::Asked;

/// The limits of one setup at a time. Until they are computed the previous ones are kept.
#[derive(Default)]
pub struct LimitsInForce {
    limits: AgeLimits,
    asked: Asked<Setup, AgeLimits>,
}

impl LimitsInForce {
    /// The limits of `system` with `setup`, as far as computed; `over` if the run has ended.
    pub fn follow(&mut self, system: &Arc<dyn System>, setup: Setup, over: bool) -> AgeLimits {
        if !self.asked.is(&setup) {
            let (system, of) = (system.clone(), setup.clone());
            self.asked.ask(setup, move || system.age_limits(&of));
        }
        self.limits = self.asked.answer(over).unwrap_or(self.limits);
        self.limits
    }

    /// Whether limits are being computed.
    pub fn are_coming(&self) -> bool {
        self.asked.is_coming()
    }

    /// The limits as far as computed.
    pub fn known(&self) -> AgeLimits {
        self.limits
    }
}
