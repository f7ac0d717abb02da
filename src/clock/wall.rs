//! Run time and wall time: their relation, and the pace that it gives virtual time.

use std::time::Duration;

use crate::{control::command::Speed, sync::Instant, time::Time};

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

/// Largest lag of virtual time that is caught up: after a suspended laptop a run
/// continues at its pace instead of racing.
const LAG: Duration = Duration::from_millis(250);

/// The relation of virtual time to wall time.
#[derive(Debug)]
pub(crate) struct Pacer {
    speed: Speed,
    wall: Option<Wall>,
}

impl Pacer {
    /// Starts pacing at run time `now`.
    pub(crate) fn new(speed: Speed, now: Time) -> Self {
        let wall = match speed {
            Speed::Unlimited => None,
            Speed::Times(pace) => Some(Wall::with_factor(now, pace.get())),
        };
        Self { speed, wall }
    }

    /// Returns whether the speed is limited.
    pub(crate) fn is_paced(&self) -> bool {
        self.wall.is_some()
    }

    /// Returns the run time that corresponds to wall time now; `None` at unlimited speed.
    pub(crate) fn now(&self) -> Option<Time> {
        self.wall.map(|wall| wall.now())
    }

    /// Returns the wall time of `time`; `None` for no wait.
    pub(crate) fn wait_for(&mut self, time: Time) -> Option<Instant> {
        let instant = self.wall?.instant_of(time);
        let late = Instant::now().saturating_duration_since(instant);
        if late > LAG {
            *self = Self::new(self.speed, time);
        }
        late.is_zero().then_some(instant)
    }
}
