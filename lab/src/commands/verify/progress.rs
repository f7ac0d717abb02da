//! Progress of a verification.

use std::{
    io::{IsTerminal, stderr},
    ops::ControlFlow,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use ratelab::runtime::Time;

/// Template of the line, which is drawn at most ten times per second.
const TEMPLATE: &str = "{wide_bar} {percent} % of {msg}  {eta} left";

/// A bar on standard error over the run time of a recording; hidden without a terminal.
pub struct Progress {
    bar: ProgressBar,
    stop: Arc<AtomicBool>,
}

impl Progress {
    /// Creates the bar for a recording that ends at `until`.
    pub fn new(until: Time, stop: &Arc<AtomicBool>) -> Self {
        let bar = if stderr().is_terminal() {
            let target = ProgressDrawTarget::stderr_with_hz(10);
            ProgressBar::with_draw_target(Some(until.as_nanos()), target)
        } else {
            ProgressBar::hidden()
        };
        let style = ProgressStyle::with_template(TEMPLATE);
        let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
        let stop = stop.clone();
        let bar = bar.with_style(style).with_message(until.to_string());
        Self { bar, stop }
    }

    /// Shows run time `now`; breaks after a signal to stop.
    pub fn look(&self, now: Time) -> ControlFlow<()> {
        self.bar.set_position(now.as_nanos());
        if self.stop.load(Ordering::Relaxed) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
