//! A progress bar on standard error.

use std::{
    fmt::Write,
    io::{IsTerminal, stderr},
};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};

/// The line for a share of something.
const SHARE: &str = "{wide_bar} {percent} % of {msg}  {eta} left";

/// The line for a number of runs.
const RUNS: &str = "{wide_bar} {human_pos} of {human_len} runs  {rate} runs/s  {eta} left";

/// A line with a bar, drawn at most ten times per second, which ends when it is dropped; hidden
/// without a terminal.
pub struct ProgressLine(ProgressBar);

impl ProgressLine {
    /// Creates a bar of this `length`, which is that of `what`.
    pub fn new(length: u64, what: String) -> Self {
        Self(bar(length, SHARE).with_message(what))
    }

    /// Creates a bar for so many `runs`, drawn with ASCII characters only if `ascii`; hidden if
    /// `quiet`.
    pub fn for_runs(runs: usize, ascii: bool, quiet: bool) -> Self {
        if quiet {
            return Self(ProgressBar::hidden());
        }
        let rate = |state: &ProgressState, out: &mut dyn Write| {
            let _ = write!(out, "{:.0}", state.per_sec()); // The next drawing tries again.
        };
        // The finished part, the next position, and the rest.
        let glyphs = if ascii { "#>-" } else { "█▌░" };
        let bar = bar(runs as u64, RUNS);
        let style = bar.style().progress_chars(glyphs).with_key("rate", rate);
        Self(bar.with_style(style))
    }

    /// Moves on to `position`.
    pub fn set(&self, position: u64) {
        self.0.set_position(position);
    }

    /// Returns whether nobody sees it.
    pub fn is_hidden(&self) -> bool {
        self.0.is_hidden()
    }

    /// Moves on by one.
    pub fn advance(&self) {
        self.0.inc(1);
    }
}

fn bar(length: u64, template: &str) -> ProgressBar {
    if !stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let target = ProgressDrawTarget::stderr_with_hz(10);
    let style =
        ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::with_draw_target(Some(length), target).with_style(style)
}

impl Drop for ProgressLine {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
