//! Who ticks when, until it begins again.

use std::time::Duration;

use crate::{
    cartpole::actuator_hz,
    runtime::{Hz, Rate, Time, hyper_period},
};

/// The longest hyper-period that is worked through: 1000 s, which rates with up
/// to three decimals stay within.
pub const LONGEST: Duration = Duration::from_secs(1_000);

/// The rates that a run can choose; that of the actuator is the plant's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rates {
    /// How often the sensor publishes.
    pub sensor: Hz,
    /// How often the policy decides.
    pub control: Hz,
}

/// One tick of one of the three nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stage {
    Sense,
    Decide,
    Act,
}

impl Rates {
    /// The time after which all three nodes are due together again.
    pub fn hyper_period(self) -> Duration {
        hyper_period([self.sensor, self.control, actuator_hz()])
    }

    /// The ticks of one hyper-period in the order in which the virtual clock
    /// runs them: by due time, then sensor before policy before actuator.
    pub(super) fn ticks(self) -> impl Iterator<Item = Stage> {
        let end = Time::ZERO + self.hyper_period();
        let mut nodes = [
            (Stage::Sense, Rate::new(self.sensor, Time::ZERO)),
            (Stage::Decide, Rate::new(self.control, Time::ZERO)),
            (Stage::Act, Rate::new(actuator_hz(), Time::ZERO)),
        ];
        std::iter::from_fn(move || {
            // Of several that are least, `min_by_key` gives the first.
            let next = nodes.iter_mut().min_by_key(|(_, rate)| rate.due());
            let (tick, rate) = next.filter(|(_, rate)| rate.due() < end)?;
            rate.advance();
            Some(*tick)
        })
    }
}
