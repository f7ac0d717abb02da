//! A progress bar on standard error.

use std::io::{IsTerminal, stderr};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Template of the line, which is drawn at most ten times per second.
const TEMPLATE: &str = "{wide_bar} {percent} % of {msg}  {eta} left";

/// A line with a bar, which ends when it is dropped; hidden without a terminal.
pub struct ProgressLine(ProgressBar);

impl ProgressLine {
    /// Creates a bar of this `length`, which is that of `what`.
    pub fn new(length: u64, what: String) -> Self {
        let bar = if stderr().is_terminal() {
            let target = ProgressDrawTarget::stderr_with_hz(10);
            ProgressBar::with_draw_target(Some(length), target)
        } else {
            ProgressBar::hidden()
        };
        let style = ProgressStyle::with_template(TEMPLATE);
        let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
        Self(bar.with_style(style).with_message(what))
    }

    /// Moves on to `position`.
    pub fn set(&self, position: u64) {
        self.0.set_position(position);
    }
}

impl Drop for ProgressLine {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
