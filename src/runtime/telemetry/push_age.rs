//! How old the sensing is behind what acts on the world, at any time.

use std::time::Duration;

use crate::runtime::{
    push::Push,
    sync::{Arc, Mutex, lock},
    time::Time,
};

/// The age of the push in force: run time now, less that of the sensing behind it.
/// It grows by itself and jumps when a fresher push is applied.
#[derive(Clone, Debug, Default)]
pub struct PushAge(Arc<Mutex<State>>);

#[derive(Debug, Default)]
struct State {
    in_force: Option<Push>,
    /// From which run time on there was a push.
    first: Time,
    /// Twice the integral of the age up to the newest push (ns²): whole numbers.
    twice_area: u128,
}

impl Push {
    /// Twice the integral of its age up to `now` (ns²).
    fn twice_area(self, now: Time) -> u128 {
        let square = |duration: Duration| duration.as_nanos().pow(2);
        let until = now.max(self.at);
        square(until.since(self.sensed)).saturating_sub(square(self.at.since(self.sensed)))
    }
}

/// The age of the push in force as it was at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PushAgeView {
    /// Run time at which it was looked at.
    pub at: Time,
    /// Run time of the first push.
    pub first: Time,
    /// The age.
    pub age: Duration,
    /// The integral of the age since the first push (s²): between two looks it
    /// grows by the mean age times the time that passed.
    pub area_s2: f64,
}

impl PushAge {
    /// What was derived from a sensing at `sensed` is applied at run time `now`.
    pub fn push(&self, now: Time, sensed: Time) {
        let mut state = lock(&self.0);
        match state.in_force {
            Some(before) => {
                let area = before.twice_area(now);
                state.twice_area = state.twice_area.saturating_add(area);
            }
            None => state.first = now,
        }
        state.in_force = Some(Push { at: now, sensed });
    }

    /// The push in force; `None` before the first.
    pub fn in_force(&self) -> Option<Push> {
        lock(&self.0).in_force
    }

    /// Run time of the sensing behind the push in force; `None` before the first.
    pub fn sensed(&self) -> Option<Time> {
        self.in_force().map(|push| push.sensed)
    }

    /// How it is at run time `now`; `None` before the first push.
    pub fn view(&self, now: Time) -> Option<PushAgeView> {
        let state = lock(&self.0);
        let push = state.in_force?;
        let twice_area = state.twice_area.saturating_add(push.twice_area(now));
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
        age.push(ms(20), ms(0)); // which to apply it again does not change,
        age.push(ms(30), ms(30)); // then fresh, for 10 ms.
        let view = age.view(ms(40)).expect("pushes");
        assert_eq!(view.age, Duration::from_millis(10));
        let mean = (20.0 * 20.0 + 10.0 * 5.0) / 30.0 / 1e3;
        assert!((view.mean_s().expect("time passed") - mean).abs() < 1e-15);
    }
}
