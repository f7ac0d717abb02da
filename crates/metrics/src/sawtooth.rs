//! Ages over time: of the sensing behind a push, of the data at the end of a chain.

use std::{collections::VecDeque, time::Duration};

use ratelab::{Push, Time};

/// Length of the recent stretch of run time, whose ages decide whether a run is lost.
pub const LATELY: Duration = Duration::from_secs(1);

/// An age over time: run time now minus the run time of the sensing behind what is in force.
/// It grows with time and drops when something fresher comes into force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sawtooth {
    /// Run time from which the first was in force.
    pub first: Time,
    /// Run time of the sensing behind what is in force.
    pub sensed: Time,
    since: Time,
    /// Twice the integral of the age until then (ns²), as a whole number.
    twice_area: u128,
    greatest: Duration,
}

impl Sawtooth {
    /// Creates the age from run time `now` on, by a sensing at `sensed`.
    pub fn new(now: Time, sensed: Time) -> Self {
        Self {
            first: now,
            sensed,
            since: now,
            twice_area: 0,
            greatest: Duration::ZERO,
        }
    }

    /// Returns the age once something sensed at `sensed` is in force, from run time `now` on.
    #[must_use]
    pub fn drop_to(&self, now: Time, sensed: Time) -> Self {
        Self {
            first: self.first,
            sensed,
            since: now,
            twice_area: self.twice_area(now),
            greatest: self.greatest(now),
        }
    }

    /// Returns the age at run time `now`.
    pub fn age(&self, now: Time) -> Duration {
        now.since(self.sensed)
    }

    /// Returns the greatest age up to run time `now`.
    pub fn greatest(&self, now: Time) -> Duration {
        self.greatest.max(self.age(now))
    }

    /// Twice the integral of the age from the first to run time `now` (ns²).
    pub fn twice_area(&self, now: Time) -> u128 {
        let square = |at: Time| self.age(at).as_nanos().pow(2);
        // The times of an altered log may be any.
        let more = square(now.max(self.since)) - square(self.since);
        self.twice_area.saturating_add(more)
    }

    /// Returns the integral of the age from the first to run time `now` (s²).
    pub fn area_s2(&self, now: Time) -> f64 {
        self.twice_area(now) as f64 / 2e18
    }

    /// Returns the mean over time from the first to run time `now` (s), or to the begin of what is
    /// in force if that is later; `None` if no time has passed.
    pub fn mean_s(&self, now: Time) -> Option<f64> {
        let time = now.max(self.since).since(self.first);
        (!time.is_zero()).then(|| self.area_s2(now) / time.as_secs_f64())
    }
}

/// The age of the push in force, with that of the last second.
#[derive(Clone, Debug, Default)]
pub struct PushAge {
    /// The teeth of the last second and the one before, the one in force last.
    late: VecDeque<Sawtooth>,
    /// Run time at which the push in force was last applied.
    applied: Time,
}

/// An age over the last second of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LateAge {
    /// Run time of its begin, not before the first push.
    pub from: Time,
    /// The mean over time (s).
    pub mean_s: f64,
    /// The greatest age.
    pub greatest: Duration,
}

impl PushAge {
    /// Adds a push at run time `now` that was derived from a sensing at `sensed`.
    pub fn push(&mut self, now: Time, sensed: Time) {
        self.applied = now;
        let next = match self.late.back() {
            Some(before) if before.sensed == sensed => return, // Applied again.
            Some(before) => before.drop_to(now, sensed),
            None => Sawtooth::new(now, sensed),
        };
        self.late.push_back(next);
        while self
            .late
            .get(1)
            .is_some_and(|next| next.since + LATELY <= now)
        {
            self.late.pop_front();
        }
    }

    /// Returns the push in force; `None` before the first.
    pub fn in_force(&self) -> Option<Push> {
        let sensed = self.late.back()?.sensed;
        let at = self.applied;
        Some(Push { at, sensed })
    }

    /// Returns the age over time of the push in force; `None` before the first.
    pub fn saw(&self) -> Option<&Sawtooth> {
        self.late.back()
    }

    /// Returns the age in the last second before run time `now`, or since the first push; `None` if
    /// no time has passed.
    pub fn lately(&self, now: Time) -> Option<LateAge> {
        let (oldest, push) = (self.late.front()?, self.late.back()?);
        // A push may be later than this reading: the oldest one that is kept may be, too.
        let from = (now - LATELY).max(oldest.since);
        let time = now.since(from).as_secs_f64();
        let then = self.late.iter().rev().find(|push| push.since <= from);
        let before = then.map_or(0, |then| then.twice_area(from));
        let ends = self.late.iter().skip(1).map(|next| next.since);
        let ages = self
            .late
            .iter()
            .zip(ends.chain([now]))
            .filter(|(_, end)| *end >= from)
            .map(|(push, end)| push.age(end));
        (time > 0.0).then(|| LateAge {
            from,
            mean_s: (push.twice_area(now) - before) as f64 / 2e18 / time,
            greatest: ages.max().unwrap_or_default(),
        })
    }
}
