//! The answer to exercise 11, for teachers: a fixed rate.

/// Nanoseconds in a second.
const NANOS: u64 = 1_000_000_000;

/// The promise to tick `hz` times a second.
#[derive(Clone, Debug)]
pub struct Rate {
    hz: u64,
    next: u64,
}

impl Rate {
    /// Creates a rate of `hz`, at least one, whose first tick is due at time zero.
    pub fn new(hz: u64) -> Self {
        Self {
            hz: hz.max(1),
            next: 0,
        }
    }

    /// Returns when the next tick is due (ns): multiplied first, so that nothing adds up.
    pub fn due(&self) -> u64 {
        let (seconds, ticks) = (self.next / self.hz, self.next % self.hz);
        seconds * NANOS + ticks * NANOS / self.hz
    }

    /// Moves on to the next tick.
    pub fn advance(&mut self) {
        self.next += 1;
    }
}
