//! The timing of a loop's nodes and links.

use std::time::Duration;

use ratelab::{Hz, Rate, Time};

use crate::actuator_hz;

/// The longest hyper-period supported: 1000 s, enough for all rates with up to three
/// decimals.
pub const LONGEST: Duration = Duration::from_secs(1_000);

/// The rates that a run can set; the actuator's rate is that of the plant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rates {
    /// Rate of the sensor.
    pub sensor: Hz,
    /// Rate of the policy.
    pub control: Hz,
}

/// The ticks of one node: tick `k` is due at `offset + k / hz`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cadence {
    /// Ticks per second.
    pub hz: Hz,
    /// Due time of the first tick.
    pub offset: Duration,
}

/// Deterministic timing of a loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Timing {
    /// Readings of the plant.
    pub sensor: Cadence,
    /// Due times of the policy.
    pub policy: Cadence,
    /// Application of actions. `None`: on delivery.
    pub actuator: Option<Cadence>,
    /// Duration of the policy's ticks: it reads at the start and publishes at the end of
    /// a tick, and skips ticks that are due in between.
    pub policy_takes: Duration,
    /// Delay of readings on their link.
    pub obs_delay: Duration,
    /// Delay of actions on their link.
    pub action_delay: Duration,
}

/// An action, with the times of its reading and of its application.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimedPush {
    /// Time of the reading.
    pub sensed: Time,
    /// Time of the application.
    pub applied: Time,
}

impl Cadence {
    /// Creates a cadence of `hz` ticks per second, from the beginning of a run.
    pub fn new(hz: Hz) -> Self {
        let offset = Duration::ZERO;
        Self { hz, offset }
    }

    fn rate(self) -> Rate {
        Rate::new(self.hz, Time::ZERO + self.offset)
    }
}

impl From<Rates> for Timing {
    /// Creates the default graph, where nothing takes time.
    fn from(Rates { sensor, control }: Rates) -> Self {
        Self {
            sensor: Cadence::new(sensor),
            policy: Cadence::new(control),
            actuator: Some(Cadence::new(actuator_hz())),
            ..Self::direct(control)
        }
    }
}

impl Timing {
    /// Creates a reading, a decision and its application at the same instant, `hz` times per
    /// second.
    pub fn direct(hz: Hz) -> Self {
        Self {
            sensor: Cadence::new(hz),
            policy: Cadence::new(hz),
            actuator: None,
            policy_takes: Duration::ZERO,
            obs_delay: Duration::ZERO,
            action_delay: Duration::ZERO,
        }
    }

    /// Returns the cadences of the nodes.
    pub(super) fn cadences(self) -> impl Iterator<Item = Cadence> {
        [self.sensor, self.policy].into_iter().chain(self.actuator)
    }

    /// Returns the largest age of the reading behind an action when the action is applied.
    pub(super) fn slowest(self) -> Duration {
        let waits = [Some(self.sensor), self.actuator].into_iter().flatten();
        let waits: Duration = waits
            .map(|cadence| cadence.hz.period() + Time::RESOLUTION)
            .sum();
        waits.saturating_add(self.constant())
    }

    /// Returns the delay from a reading to its action, without any waiting.
    pub(super) fn constant(self) -> Duration {
        let links = self.obs_delay.saturating_add(self.action_delay);
        links.saturating_add(self.policy_takes)
    }

    /// Returns all decisions: the start of each, and the resulting push. Decisions before the first
    /// reading are left out.
    pub(super) fn pushes(self) -> impl Iterator<Item = (Time, TimedPush)> {
        let (mut sensor, mut policy) = (self.sensor.rate(), self.policy.rate());
        let mut actuator = self.actuator.map(Cadence::rate);
        let starts = std::iter::from_fn(move || {
            let start = policy.due();
            policy.advance_past(start + self.policy_takes);
            Some(start)
        });
        starts.filter_map(move |start| {
            while sensor.due() + self.obs_delay <= start {
                sensor.advance();
            }
            let sensed = sensor.last_due()?;
            let delivered = start + self.policy_takes + self.action_delay;
            let applied = actuator.as_mut().map_or(delivered, |actuator| {
                while actuator.due() < delivered {
                    actuator.advance();
                }
                actuator.due()
            });
            Some((start, TimedPush { sensed, applied }))
        })
    }
}
