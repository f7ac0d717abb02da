//! How far a verification is, for those who wait for it, and Ctrl-C.

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

/// What is shown, at most ten times a second.
const TEMPLATE: &str = "{wide_bar} {percent} % of {msg}  {eta} left";

/// Whether Ctrl-C was pressed.
#[derive(Clone)]
pub struct Asked(Arc<AtomicBool>);

impl Asked {
    /// From now on the first Ctrl-C (or SIGTERM) ends a verification in order, and
    /// the second ends the program.
    pub fn listen() -> Self {
        let asked = Arc::<AtomicBool>::default();
        let stop = asked.clone();
        let installed = ctrlc::set_handler(move || {
            if stop.swap(true, Ordering::Relaxed) {
                std::process::exit(130);
            }
        });
        if let Err(error) = installed {
            eprintln!("note: Ctrl-C will end ratelab at once: {error}");
        }
        Self(asked)
    }
}

/// A bar on standard error over the run time of a recording; hidden where nobody
/// looks.
pub struct Watch {
    bar: ProgressBar,
    asked: Asked,
}

impl Watch {
    /// Of a recording that ends at `until`.
    pub fn new(until: Time, asked: &Asked) -> Self {
        let bar = if stderr().is_terminal() {
            let target = ProgressDrawTarget::stderr_with_hz(10);
            ProgressBar::with_draw_target(Some(until.as_nanos()), target)
        } else {
            ProgressBar::hidden()
        };
        let style = ProgressStyle::with_template(TEMPLATE);
        let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
        let asked = asked.clone();
        let bar = bar.with_style(style).with_message(until.to_string());
        Self { bar, asked }
    }

    /// Run time has come to `now`: go on, unless Ctrl-C was pressed.
    pub fn look(&self, now: Time) -> ControlFlow<()> {
        self.bar.set_position(now.as_nanos());
        if self.asked.0.load(Ordering::Relaxed) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
