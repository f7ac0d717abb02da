//! Runs in the background, at low priority.

use std::{
    num::NonZeroUsize,
    ops::ControlFlow,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread,
};

use crossbeam_channel::{Receiver, TryRecvError, unbounded};
use ratelab::{
    experiment::sweep::{Cell, CellResult, Sweep, SweepError},
    runtime::clock::lower_priority,
};

/// A run and its result.
pub type Made = (Cell, CellResult);

/// A sweep on one thread, which runs where the graph and the screen leave a core
/// idle. Ends when dropped.
pub struct Fill {
    made: Receiver<Result<Made, SweepError>>,
    stop: Arc<AtomicBool>,
}

impl Fill {
    /// Begins to run the cells of `sweep`.
    pub fn start(sweep: Sweep) -> Self {
        // No more can wait than there are cells.
        let (sender, made) = unbounded();
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = stop.clone();
        // Dropping does not wait for its end, which may take long on a busy machine.
        thread::spawn(move || {
            lower_priority();
            let swept = sweep.run(NonZeroUsize::MIN, |cell, outcome| {
                let told = sender.send(Ok((cell.clone(), outcome.clone())));
                if stopped.load(Ordering::Relaxed) || told.is_err() {
                    ControlFlow::Break(())
                } else {
                    ControlFlow::Continue(())
                }
            });
            if let Err(error) = swept {
                let _ = sender.send(Err(error)); // Nobody may be left to tell.
            }
        });
        Self { made, stop }
    }

    /// A run that was made, if one waits to be looked at.
    ///
    /// # Errors
    /// [`SweepError`] if one failed, which is the last.
    pub fn next(&self) -> Result<Option<Made>, SweepError> {
        match self.made.try_recv() {
            Ok(made) => made.map(Some),
            Err(TryRecvError::Empty | TryRecvError::Disconnected) => Ok(None),
        }
    }

    #[cfg(test)]
    pub fn nobody() -> Self {
        Self {
            made: crossbeam_channel::never(),
            stop: Arc::default(),
        }
    }
}

impl Drop for Fill {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}
