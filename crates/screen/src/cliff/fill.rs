//! Runs in the background, at low priority.

use std::{num::NonZeroUsize, ops::ControlFlow, thread};

use crossbeam_channel::{Receiver, unbounded};
use ratelab::Interrupt;
use ratelab_experiment::sweep::{Cell, CellResult, Sweep, SweepError};
use ratelab_real_clock::lower_priority;

/// A run and its result.
pub type Made = (Cell, CellResult);

/// A sweep on one low-priority thread, for the time that graph and screen leave idle.
/// Ends when dropped.
pub struct Fill {
    made: Receiver<Result<Made, SweepError>>,
    interrupt: Interrupt,
}

impl Fill {
    /// Starts the runs of `sweep`.
    pub fn start(sweep: Sweep) -> Self {
        // The queue holds at most one item per cell.
        let (sender, made) = unbounded();
        let interrupt = Interrupt::default();
        let asked = interrupt.clone();
        // Dropping does not wait for its end, which may take long on a busy machine.
        thread::spawn(move || {
            lower_priority();
            let swept = sweep.run_until(&asked, NonZeroUsize::MIN, |cell, outcome| {
                let told = sender.send(Ok((cell.clone(), outcome.clone())));
                match told {
                    Ok(()) => ControlFlow::Continue(()),
                    Err(_) => ControlFlow::Break(()),
                }
            });
            if let Err(error) = swept {
                let _ = sender.send(Err(error)); // The receiver may be gone.
            }
        });
        Self { made, interrupt }
    }

    /// Returns the next finished run, if any.
    ///
    /// # Errors
    /// [`SweepError`] if a run failed; it is the last item.
    pub fn next(&self) -> Result<Option<Made>, SweepError> {
        self.made.try_recv().ok().transpose()
    }

    /// Waits for the next finished run, in place of looking for it again and again: its thread
    /// has a low priority.
    #[cfg(test)]
    pub fn wait(&self) {
        let mut select = crossbeam_channel::Select::new();
        select.recv(&self.made);
        select.ready();
    }

    #[cfg(test)]
    pub fn nobody() -> Self {
        Self {
            made: crossbeam_channel::never(),
            interrupt: Interrupt::default(),
        }
    }
}

impl Drop for Fill {
    fn drop(&mut self) {
        self.interrupt.ask();
    }
}
