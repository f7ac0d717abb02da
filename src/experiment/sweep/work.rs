//! A sweep on several threads, with the same outcome as on one.

use std::{
    num::NonZeroUsize,
    ops::ControlFlow,
    sync::atomic::{AtomicBool, AtomicUsize, Ordering},
    thread,
};

use crossbeam_channel::{Receiver, Sender};

use super::{Cell, CellResult, Sweep, SweepError, Swept};

/// Finished cells that may wait for the caller to look at them.
const WAITING: usize = 1_024;

/// As many threads as this machine runs at a time.
pub fn all_cores() -> NonZeroUsize {
    thread::available_parallelism().unwrap_or(NonZeroUsize::MIN)
}

/// A cell, its number, and its result.
type FinishedCell = (usize, Cell, Result<CellResult, SweepError>);

/// What the threads of a sweep share.
struct Work {
    sweep: Sweep,
    cells: usize,
    next: AtomicUsize,
    stop: AtomicBool,
}

impl Sweep {
    /// Runs all cells on `threads` threads; the outcomes do not depend on how
    /// many. `finished` is told of each cell on the calling thread, as they
    /// finish, which is not quite in order. If it breaks, no further cell is
    /// begun and what is done is kept.
    ///
    /// # Errors
    /// [`SweepError`] if there is nothing to run, too much, or a cell failed.
    pub fn run(
        &self,
        threads: NonZeroUsize,
        finished: impl FnMut(&Cell, &CellResult) -> ControlFlow<()>,
    ) -> Result<Swept, SweepError> {
        let cells = self.cells()?;
        let work = Work {
            sweep: self.resolved()?,
            cells,
            next: AtomicUsize::new(0),
            stop: AtomicBool::new(false),
        };
        thread::scope(|scope| {
            let (sender, done) = crossbeam_channel::bounded(WAITING);
            for _ in 0..threads.get().min(work.cells) {
                let (work, sender) = (&work, sender.clone());
                scope.spawn(move || work.run(&sender));
            }
            drop(sender);
            work.collect(done, finished)
        })
    }
}

impl Work {
    /// Takes cells one by one until there are no more.
    fn run(&self, done: &Sender<FinishedCell>) {
        while !self.stopped() {
            let index = self.next.fetch_add(1, Ordering::Relaxed);
            let cell = self.sweep.cell(index).filter(|_| index < self.cells);
            let Some(cell) = cell else { return };
            let outcome = self.sweep.execute(&cell);
            if done.send((index, cell, outcome)).is_err() {
                return; // The caller panicked.
            }
        }
    }

    fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Puts what the threads found in its place.
    fn collect(
        &self,
        done: Receiver<FinishedCell>,
        mut finished: impl FnMut(&Cell, &CellResult) -> ControlFlow<()>,
    ) -> Result<Swept, SweepError> {
        let mut outcomes = vec![None; self.cells];
        let mut failed = None;
        for (index, cell, outcome) in done {
            let go_on = match outcome {
                Ok(outcome) => {
                    let go_on = !self.stopped() && finished(&cell, &outcome).is_continue();
                    outcomes[index] = Some(outcome);
                    go_on
                }
                Err(error) => {
                    failed.get_or_insert(error);
                    false
                }
            };
            if !go_on {
                self.stop.store(true, Ordering::Relaxed);
            }
        }
        let sweep = self.sweep.clone();
        failed.map_or(Ok(Swept { sweep, outcomes }), Err)
    }
}
