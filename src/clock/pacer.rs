//! The pace of virtual time: as fast as it can, or a factor of wall time.

use std::time::Duration;

use super::wall::Wall;
use crate::{control::command::Speed, sync::Instant, time::Time};

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
