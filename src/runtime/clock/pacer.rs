//! Lets virtual time pass no faster than asked.

use std::time::Duration;

use super::wall::Wall;
use crate::runtime::{command::Speed, sync::Instant, time::Time};

/// How far virtual time may fall behind its pace before the pacer gives up
/// catching up: after a suspended laptop a run goes on, it does not race.
const LAG: Duration = Duration::from_millis(250);

/// Virtual time against wall time.
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

    /// Whether run time keeps pace with wall time at all.
    pub(crate) fn is_paced(&self) -> bool {
        self.wall.is_some()
    }

    /// The run time that wall time has come to; `None` flat out.
    pub(crate) fn now(&self) -> Option<Time> {
        self.wall.map(|wall| wall.now())
    }

    /// When `time` may happen; `None` if at once.
    pub(crate) fn wait_for(&mut self, time: Time) -> Option<Instant> {
        let instant = self.wall?.instant_of(time);
        let late = Instant::now().saturating_duration_since(instant);
        if late > LAG {
            *self = Self::new(self.speed, time);
        }
        late.is_zero().then_some(instant)
    }
}
