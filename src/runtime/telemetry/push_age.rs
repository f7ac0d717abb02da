//! The age of the sensing behind the push in force, over time.

use std::time::Duration;

use crate::runtime::{
    sync::{Arc, Mutex, lock},
    time::Time,
};

/// The age of the push in force: run time now minus the run time of the sensing behind
/// it. It grows with time and drops when a fresher push is applied.
#[derive(Clone, Debug, Default)]
pub struct PushAge(Arc<Mutex<State>>);

#[derive(Debug, Default)]
struct State {
    in_force: Option<InForce>,
    /// Run time of the first push.
    first: Time,
    /// Twice the integral of the age up to the newest push (ns²): whole numbers.
    twice_area: u128,
}

#[derive(Clone, Copy, Debug)]
struct InForce {
    since: Time,
    sensed: Time,
}

impl InForce {
    /// Twice the integral of the age up to `now` (ns²).
    fn twice_area(self, now: Time) -> u128 {
        let age = |at: Time| u128::from(at.as_nanos().saturating_sub(self.sensed.as_nanos()));
        age(now.max(self.since)).pow(2) - age(self.since).pow(2)
    }
}

/// The age of the push in force at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PushAgeView {
    /// Run time of this reading.
    pub at: Time,
    /// Run time of the first push.
    pub first: Time,
    /// The age.
    pub age: Duration,
    /// The integral of the age since the first push (s²): between two readings it grows
    /// by the mean age times the elapsed time.
    pub area_s2: f64,
}

impl PushAge {
    /// Records a push at run time `now` that was derived from a sensing at `sensed`.
    pub fn push(&self, now: Time, sensed: Time) {
        let mut state = lock(&self.0);
        match state.in_force {
            Some(before) => state.twice_area += before.twice_area(now),
            None => state.first = now,
        }
        state.in_force = Some(InForce { since: now, sensed });
    }

    /// Run time of the sensing behind the push in force; `None` before the first.
    pub fn sensed(&self) -> Option<Time> {
        lock(&self.0).in_force.map(|push| push.sensed)
    }

    /// Reads the age at run time `now`; `None` before the first push.
    pub fn view(&self, now: Time) -> Option<PushAgeView> {
        let state = lock(&self.0);
        let push = state.in_force?;
        let twice_area = state.twice_area + push.twice_area(now);
        Some(PushAgeView {
            at: now,
            first: state.first,
            age: now.since(push.sensed),
            area_s2: twice_area as f64 / 2e18,
        })
    }
}

impl PushAgeView {
    /// The mean over time since the first push (s); `None` if no time has passed.
    pub fn mean_s(&self) -> Option<f64> {
        let time = self.at.since(self.first);
        (!time.is_zero()).then(|| self.area_s2 / time.as_secs_f64())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(ms: u64) -> Time {
        Time::from_nanos(ms * 1_000_000)
    }

    #[test]
    fn the_mean_is_over_time_and_not_over_pushes() {
        let age = PushAge::default();
        assert_eq!(age.view(ms(1)), None);
        age.push(ms(10), ms(0)); // 10 to 30 ms old for 20 ms,
        age.push(ms(20), ms(0)); // unchanged by applying it again,
        age.push(ms(30), ms(30)); // then 0 to 10 ms old for 10 ms.
        let view = age.view(ms(40)).expect("pushes");
        assert_eq!(view.age, Duration::from_millis(10));
        let mean = (20.0 * 20.0 + 10.0 * 5.0) / 30.0 / 1e3;
        assert!((view.mean_s().expect("time passed") - mean).abs() < 1e-15);
    }
}
