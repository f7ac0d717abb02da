//! When the nodes of a loop tick and how long everything takes.

use std::time::Duration;

use crate::{
    cartpole::actuator_hz,
    runtime::{Hz, Rate, Time},
};

/// The rates that a run can choose; that of the actuator is the plant's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rates {
    /// How often the sensor publishes.
    pub sensor: Hz,
    /// How often the policy decides.
    pub control: Hz,
}

/// The ticks of one node: tick `k` is due at `offset + k / hz`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cadence {
    /// Ticks per second.
    pub hz: Hz,
    /// When the first is due.
    pub offset: Duration,
}

/// The timing of a loop in which nothing is left to chance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Timing {
    /// When the sensor reads the plant.
    pub sensor: Cadence,
    /// When the policy is due.
    pub policy: Cadence,
    /// When actions are applied. `None`: as soon as they are delivered.
    pub actuator: Option<Cadence>,
    /// What each tick of the policy takes: it reads at its beginning and
    /// publishes at its end, and skips what is due in between.
    pub policy_takes: Duration,
    /// How long a reading is on its way.
    pub obs_delay: Duration,
    /// How long an action is on its way.
    pub action_delay: Duration,
}

/// An action, from the reading behind it to the moment that it is applied.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Push {
    /// When the plant was read.
    pub sensed: Time,
    /// When the action is applied.
    pub applied: Time,
}

impl Cadence {
    /// So many ticks per second, from the beginning of a run.
    pub fn new(hz: Hz) -> Self {
        let offset = Duration::ZERO;
        Self { hz, offset }
    }

    fn rate(self) -> Rate {
        Rate::new(self.hz, Time::ZERO + self.offset)
    }
}

impl From<Rates> for Timing {
    /// The graph as it is, with nothing that takes time.
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
    /// A reading, a decision and its application, so many times a second, all
    /// in one instant.
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

    /// The nodes.
    pub(super) fn cadences(self) -> impl Iterator<Item = Cadence> {
        [self.sensor, self.policy].into_iter().chain(self.actuator)
    }

    /// The oldest that the reading behind an action can be when the action is
    /// applied.
    pub(super) fn slowest(self) -> Duration {
        let waits = [Some(self.sensor), self.actuator].into_iter().flatten();
        let waits: Duration = waits.map(|cadence| cadence.hz.period() + Time::TICK).sum();
        waits.saturating_add(self.constant())
    }

    /// How long everything takes from a reading to its action without any waiting.
    pub(super) fn constant(self) -> Duration {
        let links = self.obs_delay.saturating_add(self.action_delay);
        links.saturating_add(self.policy_takes)
    }

    /// Every decision: when it was begun, and the push that came of it. Decisions
    /// before the first reading come to nothing.
    pub(super) fn pushes(self) -> impl Iterator<Item = (Time, Push)> {
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
            Some((start, Push { sensed, applied }))
        })
    }
}
