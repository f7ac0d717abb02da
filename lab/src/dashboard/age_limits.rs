//! What a loop bears with the knobs in force, found out beside the run.

use std::{sync::Arc, thread, time::Duration};

use crossbeam_channel::{Receiver, bounded};
use ratelab::system::{AgeLimits, Setup, System};

/// How long a frame of a run that is over waits: nothing else will change.
const PATIENCE: Duration = Duration::from_millis(100);

/// The limits of one setup at a time. Finding them out takes seconds at odd rates:
/// until then those before are kept.
#[derive(Default)]
pub struct LimitsInForce {
    setup: Option<Setup>,
    limits: AgeLimits,
    coming: Option<Receiver<AgeLimits>>,
}

impl LimitsInForce {
    /// Those of `system` with `setup`, as far as they are known by now.
    pub fn follow(&mut self, system: &Arc<dyn System>, setup: Setup, over: bool) -> AgeLimits {
        if self.setup.as_ref() != Some(&setup) {
            let (sender, coming) = bounded(1);
            let (system, asked) = (system.clone(), setup.clone());
            thread::spawn(move || {
                // Nobody may wait for them any more.
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

    /// Those that are known.
    pub fn known(&self) -> AgeLimits {
        self.limits
    }
}
