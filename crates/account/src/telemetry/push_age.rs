//! The age of the sensing behind the push in force, over time.

use std::{collections::VecDeque, time::Duration};

use ratelab::{
    Push, Time,
    sync::{Arc, Mutex, lock},
};

/// The end of a run whose ages decide whether it is lost.
const LATE: Duration = Duration::from_secs(1);

/// The age of the push in force: run time now minus the run time of the sensing behind
/// it. It grows with time and drops when a fresher push is applied.
#[derive(Clone, Debug, Default)]
pub struct PushAge(Arc<Mutex<Pushes>>);

#[derive(Debug, Default)]
struct Pushes {
    /// The pushes of the last second and the one before, the one in force last.
    late: VecDeque<InForce>,
    /// Run time of the first push.
    first: Time,
    /// Run time at which the push in force was last applied.
    applied: Time,
}

#[derive(Clone, Copy, Debug)]
struct InForce {
    since: Time,
    sensed: Time,
    /// Twice the integral of the age until then (ns²), as a whole number.
    twice_area: u128,
}

impl InForce {
    /// The same up to `now`, while it is in force.
    fn twice_area(self, now: Time) -> u128 {
        let age = |at: Time| u128::from(at.as_nanos().saturating_sub(self.sensed.as_nanos()));
        // The times of an altered log may be any.
        let more = age(now.max(self.since)).pow(2) - age(self.since).pow(2);
        self.twice_area.saturating_add(more)
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
    /// The mean over the last second, or since the first push (s); `None` if no time
    /// has passed.
    pub late_s: Option<f64>,
    /// The greatest age in that time.
    pub late_greatest: Duration,
}

impl PushAge {
    /// Records a push at run time `now` that was derived from a sensing at `sensed`.
    pub fn push(&self, now: Time, sensed: Time) {
        let mut state = lock(&self.0);
        state.applied = now;
        let twice_area = match state.late.back() {
            Some(before) if before.sensed == sensed => return, // Applied again.
            Some(before) => before.twice_area(now),
            None => {
                state.first = now;
                0
            }
        };
        state.late.push_back(InForce {
            since: now,
            sensed,
            twice_area,
        });
        while state
            .late
            .get(1)
            .is_some_and(|next| next.since + LATE <= now)
        {
            state.late.pop_front();
        }
    }

    /// The push in force; `None` before the first.
    pub fn in_force(&self) -> Option<Push> {
        let state = lock(&self.0);
        let sensed = state.late.back()?.sensed;
        let at = state.applied;
        Some(Push { at, sensed })
    }

    /// Reads the age at run time `now`; `None` before the first push.
    pub fn view(&self, now: Time) -> Option<PushAgeView> {
        let state = lock(&self.0);
        let push = state.late.back()?;
        let twice_area = push.twice_area(now);
        let from = Time::from_nanos(now.as_nanos().saturating_sub(LATE.as_nanos() as u64));
        // A push may be later than this reading: the oldest one that is kept may be, too.
        let kept = state
            .late
            .front()
            .map_or(state.first, |oldest| oldest.since);
        let from = from.max(kept);
        let then = state.late.iter().rev().find(|push| push.since <= from);
        let before = then.map_or(0, |then| then.twice_area(from));
        let late = now.since(from).as_secs_f64();
        let ends = state.late.iter().skip(1).map(|next| next.since);
        let pushes = state.late.iter().zip(ends.chain([now]));
        let late_pushes = pushes.filter(|(_, end)| *end >= from);
        let ages = late_pushes.map(|(push, end)| end.since(push.sensed));
        Some(PushAgeView {
            at: now,
            first: state.first,
            age: now.since(push.sensed),
            area_s2: twice_area as f64 / 2e18,
            late_s: (late > 0.0).then(|| (twice_area - before) as f64 / 2e18 / late),
            late_greatest: ages.max().unwrap_or_default(),
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
    fn a_push_after_the_reading_leaves_the_last_second_as_it_is() {
        let pushes = PushAge::default();
        for at in (0..5_000).step_by(20) {
            pushes.push(ms(at), ms(at));
        }
        let before = pushes.view(ms(4_985)).and_then(|view| view.late_s);
        pushes.push(ms(5_001), ms(5_001));
        let after = pushes.view(ms(4_985)).and_then(|view| view.late_s);
        let [before, after] = [before, after].map(|mean| mean.expect("a mean"));
        assert!(
            after < 0.021 && (before - after).abs() < 0.005,
            "{before} {after}"
        );
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
        assert_eq!(view.late_s, view.mean_s());
    }

    #[test]
    fn the_last_second_begins_in_the_middle_of_a_push() {
        let age = PushAge::default();
        age.push(ms(0), ms(0)); // 0 to 600 ms old, then
        age.push(ms(600), ms(600)); // 0 to 1000 ms old.
        let late = |now| {
            let view = age.view(ms(now)).expect("pushes");
            let greatest = view.late_greatest.as_millis();
            (view.late_s.expect("time passed"), greatest)
        };
        for (now, mean, greatest) in [
            (600, 0.3, 600),
            (1_200, 0.4 * 0.4 + 0.6 * 0.3, 600),
            (1_600, 0.5, 1_000),
            (1_700, 0.6, 1_100),
        ] {
            let (mean_s, greatest_ms) = late(now);
            assert!((mean_s - mean).abs() < 1e-15, "{mean_s} at {now}");
            assert_eq!(greatest_ms, greatest, "at {now}");
        }
    }
}
