//! Progress of a verification.

use std::{
    ops::ControlFlow,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use ratelab::Time;

use crate::output::ProgressLine;

/// A bar on standard error over the run time of a recording; hidden without a terminal.
pub struct Progress {
    bar: ProgressLine,
    stop: Arc<AtomicBool>,
}

impl Progress {
    /// Creates the bar for a recording that ends at `until`.
    pub fn new(until: Time, stop: &Arc<AtomicBool>) -> Self {
        let bar = ProgressLine::new(until.as_nanos(), until.to_string());
        let stop = stop.clone();
        Self { bar, stop }
    }

    /// Shows run time `now`; breaks after a signal to stop.
    pub fn look(&self, now: Time) -> ControlFlow<()> {
        self.bar.set(now.as_nanos());
        if self.stop.load(Ordering::Relaxed) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }
}
