//! Progress of a sweep.

use std::{
    fmt::Write,
    io::{IsTerminal, stderr},
};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};

/// Template of the line, which is drawn at most ten times per second.
const TEMPLATE: &str = "{wide_bar} {human_pos} of {human_len} runs  {rate} runs/s  {eta} left";

/// A bar on standard error, with rate and remaining time; hidden without a terminal.
pub struct Bar(ProgressBar);

impl Bar {
    /// Creates a bar for `runs`, drawn with `glyphs` for the finished part, the next
    /// position, and the rest; hidden if `quiet`, or if standard error is no terminal.
    pub fn new(runs: usize, glyphs: &str, quiet: bool) -> Self {
        if quiet || !stderr().is_terminal() {
            return Self(ProgressBar::hidden());
        }
        let target = ProgressDrawTarget::stderr_with_hz(10);
        let bar = ProgressBar::with_draw_target(Some(runs as u64), target);
        let style = ProgressStyle::with_template(TEMPLATE);
        let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
        let rate = |state: &ProgressState, out: &mut dyn Write| {
            let _ = write!(out, "{:.0}", state.per_sec()); // The next drawing tries again.
        };
        Self(bar.with_style(style.progress_chars(glyphs).with_key("rate", rate)))
    }

    /// Counts a finished run.
    pub fn advance(&self) {
        self.0.inc(1);
    }

    /// Removes the bar.
    pub fn finish(&self) {
        self.0.finish_and_clear();
    }
}
