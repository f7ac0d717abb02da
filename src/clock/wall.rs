//! Run time that keeps pace with the wall clock: as fast, or at another speed.

use std::time::Duration;

use crate::{sync::Instant, time::Time};

/// Longer than any wait: a clock with a longer wait wakes and waits again.
const FAR: Duration = Duration::from_secs(365 * 24 * 3600);

/// The relation of run time to wall time: one common moment and a factor.
#[derive(Clone, Copy, Debug)]
pub struct Wall {
    wall: Instant,
    run: Time,
    factor: f64,
}

impl Wall {
    /// Run time is `run` now and passes as fast as wall time.
    pub fn starting_at(run: Time) -> Self {
        Self::with_factor(run, 1.0)
    }

    /// Run time is `run` now and passes `factor` times as fast as wall time.
    pub(crate) fn with_factor(run: Time, factor: f64) -> Self {
        Self {
            wall: Instant::now(),
            run,
            factor,
        }
    }

    /// Returns the wall time of run time zero, at the pace of the wall; `None` if that was before
    /// the machine started.
    pub fn zero(&self) -> Option<Instant> {
        let run = Duration::from_nanos(self.run.as_nanos());
        self.wall.checked_sub(run)
    }

    /// Returns the run time now.
    pub fn now(&self) -> Time {
        self.run + self.scaled(self.wall.elapsed(), self.factor)
    }

    /// Returns the wall time at which run time will be `time`.
    pub fn instant_of(&self, time: Time) -> Instant {
        let wait = self.scaled(time.since(self.run), self.factor.recip());
        self.wall.checked_add(wait.min(FAR)).unwrap_or(self.wall)
    }

    /// Exact for a factor of one.
    fn scaled(&self, duration: Duration, factor: f64) -> Duration {
        if self.factor == 1.0 {
            duration
        } else {
            Duration::try_from_secs_f64(duration.as_secs_f64() * factor).unwrap_or(FAR)
        }
    }
}
