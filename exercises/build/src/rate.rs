//! A fixed rate. Yours to write.

/// The promise to tick `hz` times a second: tick `k` is due `k / hz` seconds after the start
/// of the run, in whole nanoseconds, rounded down. No error may add up: after an hour, two
/// rates that ought to tie still do.
#[derive(Clone, Debug)]
pub struct Rate {
    // Replace this: what do you need to know, to tell when the next tick is due?
    nothing: (),
}

impl Rate {
    /// Creates a rate of `hz`, at least one, whose first tick is due at time zero.
    pub fn new(_hz: u64) -> Self {
        Self { nothing: () }
    }

    /// Returns when the next tick is due (ns).
    pub fn due(&self) -> u64 {
        let () = self.nothing;
        todo!("compute when the next tick is due")
    }

    /// Moves on to the next tick.
    pub fn advance(&mut self) {
        todo!("move on to the next tick")
    }
}
