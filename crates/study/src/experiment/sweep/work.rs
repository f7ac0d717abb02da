//! A sweep on several threads, with the same results as on one.

use std::{
    num::NonZeroUsize,
    ops::ControlFlow,
    sync::atomic::{AtomicUsize, Ordering},
    thread,
};

use crossbeam_channel::{Receiver, Sender};
use ratelab::Interrupt;

use super::{Cell, CellResult, Sweep, SweepError, Swept};

/// Maximum number of finished cells waiting for the caller.
const WAITING: usize = 1_024;

/// Number of threads that this machine runs in parallel.
pub fn all_cores() -> NonZeroUsize {
    thread::available_parallelism().unwrap_or(NonZeroUsize::MIN)
}

/// A cell with its index and its result.
type FinishedCell = (usize, Cell, Result<CellResult, SweepError>);

/// Data shared by the threads of a sweep.
struct Work {
    sweep: Sweep,
    cells: usize,
    next: AtomicUsize,
    interrupt: Interrupt,
}

impl Sweep {
    /// Runs all cells on `threads` threads; the results are independent of their number.
    /// Calls `finished` on the calling thread for each cell, roughly in order. If it
    /// breaks, no further cell begins, and the finished ones are kept.
    ///
    /// # Errors
    /// [`SweepError`] if the sweep is empty or too large, or if a cell failed.
    pub fn run(
        &self,
        threads: NonZeroUsize,
        finished: impl FnMut(&Cell, &CellResult) -> ControlFlow<()>,
    ) -> Result<Swept, SweepError> {
        self.run_until(&Interrupt::default(), threads, finished)
    }

    /// The same until `interrupt` is asked for, which stops the runs that go on as well.
    ///
    /// # Errors
    /// [`SweepError`] if the sweep is empty or too large, or if a cell failed.
    pub fn run_until(
        &self,
        interrupt: &Interrupt,
        threads: NonZeroUsize,
        finished: impl FnMut(&Cell, &CellResult) -> ControlFlow<()>,
    ) -> Result<Swept, SweepError> {
        let cells = self.cells()?;
        let work = Work {
            sweep: self.resolved()?,
            cells,
            next: AtomicUsize::new(0),
            interrupt: interrupt.clone(),
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
    /// Runs cells until none are left.
    fn run(&self, done: &Sender<FinishedCell>) {
        while !self.interrupt.is_asked() {
            let index = self.next.fetch_add(1, Ordering::Relaxed);
            let cell = self.sweep.cell(index).filter(|_| index < self.cells);
            let Some(cell) = cell else { return };
            let outcome = self.sweep.execute(&cell, &self.interrupt);
            let Some(outcome) = outcome.transpose() else {
                return;
            };
            if done.send((index, cell, outcome)).is_err() {
                return; // The caller panicked.
            }
        }
    }

    /// Stores the threads' results in the order of the cells.
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
                    let asked = self.interrupt.is_asked();
                    let go_on = !asked && finished(&cell, &outcome).is_continue();
                    outcomes[index] = Some(outcome);
                    go_on
                }
                Err(error) => {
                    failed.get_or_insert(error);
                    false
                }
            };
            if !go_on {
                self.interrupt.ask();
            }
        }
        let sweep = self.sweep.clone();
        failed.map_or(Ok(Swept { sweep, outcomes }), Err)
    }
}
