//! The age limits of a loop with the knobs in force, computed in the background.

use std::{sync::Arc, thread, time::Duration};

use crossbeam_channel::{Receiver, bounded};
use ratelab_study::system::{AgeLimits, Setup, System};

/// Maximum wait of a frame after the end of a run, when no later frame will come.
const PATIENCE: Duration = Duration::from_millis(100);

/// The limits of one setup at a time. Until they are computed the previous ones are kept.
#[derive(Default)]
pub struct LimitsInForce {
    setup: Option<Setup>,
    limits: AgeLimits,
    coming: Option<Receiver<AgeLimits>>,
}

impl LimitsInForce {
    /// The limits of `system` with `setup`, as far as computed.
    pub fn follow(&mut self, system: &Arc<dyn System>, setup: Setup, over: bool) -> AgeLimits {
        if self.setup.as_ref() != Some(&setup) {
            let (sender, coming) = bounded(1);
            let (system, asked) = (system.clone(), setup.clone());
            thread::spawn(move || {
                // The receiver may be gone.
                let _ = sender.send(system.age_limits(&asked));
            });
            (self.setup, self.coming) = (Some(setup), Some(coming));
        }
        let patience = if over { PATIENCE } else { Duration::ZERO };
        let come = self.coming.as_ref();
        if let Some(limits) = come.and_then(|coming| coming.recv_timeout(patience).ok()) {
            (self.limits, self.coming) = (limits, None);
        }
        self.limits
    }

    /// Whether limits are being computed.
    pub fn are_coming(&self) -> bool {
        self.coming.is_some()
    }

    /// The limits as far as computed.
    pub fn known(&self) -> AgeLimits {
        self.limits
    }
}
