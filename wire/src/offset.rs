//! How far the clock of another machine is ahead of ours, with rigorous bounds.
//!
//! A query leaves at `t1`, arrives at `t2`, the reply leaves at `t3` and arrives at `t4`;
//! `t2` and `t3` are read from the other clock. No message arrives before it leaves, so the
//! other clock is ahead by at least `t3 - t4` and by at most `t2 - t1`: half the round trip
//! either way of the middle, however uneven the two ways are.

use std::{
    collections::{HashMap, VecDeque},
    sync::{Mutex, PoisonError},
};

use crate::clock::{self, ClockId, Nanos};

/// Round trips that are kept.
const KEPT: usize = 16;

/// By how much two clocks may drift apart (ns per ns): 100 ppm, five times the tolerance of
/// usual quartzes.
const DRIFT: f64 = 1e-4;

/// The four times of a query and its reply.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RoundTrip {
    /// When the query left, by our clock.
    pub left: Nanos,
    /// When it arrived there, by the other clock.
    pub arrived: Nanos,
    /// When the reply left, by the other clock.
    pub answered: Nanos,
    /// When the reply arrived, by our clock.
    pub returned: Nanos,
}

/// How far another clock is ahead.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Estimate {
    /// The other clock's reading less ours (ns).
    pub ahead: Nanos,
    /// The greatest error of that (ns); zero for the same clock.
    pub bound: Nanos,
}

impl Estimate {
    /// The other clock is ours.
    pub const SAME: Self = Self { ahead: 0, bound: 0 };

    /// The moment of our clock at `theirs` of the other one.
    pub fn ours(self, theirs: Nanos) -> Nanos {
        theirs.saturating_sub(self.ahead)
    }
}

impl RoundTrip {
    /// The estimate from this round trip alone, at `now`; `None` if its times are
    /// impossible.
    fn estimate(self, now: Nanos) -> Option<Estimate> {
        let most = self.arrived.checked_sub(self.left)?;
        let least = self.answered.checked_sub(self.returned)?;
        let width = most.checked_sub(least).filter(|width| *width >= 0)?;
        let age = now.saturating_sub(self.returned).max(0);
        Some(Estimate {
            ahead: least + width / 2,
            bound: width / 2 + 1 + (age as f64 * DRIFT).ceil() as Nanos,
        })
    }
}

/// The newest round trips to another machine.
#[derive(Clone, Debug, Default)]
pub struct Offset(VecDeque<RoundTrip>);

impl Offset {
    /// Adds a round trip. Returns `false` and ignores it if its times are impossible, as
    /// those of a clock that was set are.
    #[must_use]
    pub fn add(&mut self, trip: RoundTrip) -> bool {
        let possible = trip.returned >= trip.left && trip.answered >= trip.arrived;
        let possible = possible && trip.estimate(trip.returned).is_some();
        if possible {
            self.0.push_back(trip);
            if self.0.len() > KEPT {
                self.0.pop_front();
            }
        }
        possible
    }

    /// The estimate with the least bound at `now`, if there is any.
    pub fn at(&self, now: Nanos) -> Option<Estimate> {
        let all = self.0.iter().filter_map(|trip| trip.estimate(now));
        all.min_by_key(|estimate| estimate.bound)
    }
}

/// How far the clocks of all other machines are ahead of ours.
#[derive(Debug, Default)]
pub struct Offsets(Mutex<HashMap<ClockId, Offset>>);

impl Offsets {
    /// How far `clock` is ahead of ours; `None` while unknown.
    pub fn estimate(&self, clock: ClockId) -> Option<Estimate> {
        if clock == ClockId::here() {
            return Some(Estimate::SAME);
        }
        let offsets = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        offsets.get(&clock)?.at(clock::now())
    }

    /// Adds a round trip to `clock`.
    pub fn add(&self, clock: ClockId, trip: RoundTrip) {
        let mut offsets = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let offset = offsets.entry(clock).or_default();
        if !offset.add(trip) {
            // A clock that was set: what was known of it is worth nothing.
            *offset = Offset::default();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A round trip at `left` to a clock that is `ahead`, with these delays.
    fn trip(left: Nanos, ahead: Nanos, there: Nanos, back: Nanos) -> RoundTrip {
        let arrived = left + there + ahead;
        let answered = arrived + 7;
        let returned = answered - ahead + back;
        RoundTrip {
            left,
            arrived,
            answered,
            returned,
        }
    }

    #[test]
    fn the_true_offset_is_within_the_bound_however_uneven_the_ways() {
        for ahead in [-5_000_000_000, -3, 0, 1, 9_000_000_000_000] {
            let mut offset = Offset::default();
            for (there, back) in [(900_000, 20), (10, 400_000), (60_000, 70_000), (0, 0)] {
                assert!(offset.add(trip(1_000, ahead, there, back)));
                let found = offset.at(1_000_000).expect("a round trip");
                assert!((found.ahead - ahead).abs() <= found.bound, "{found:?}");
            }
        }
    }

    #[test]
    fn the_least_round_trip_counts_until_drift_has_eaten_its_lead() {
        let mut offset = Offset::default();
        assert!(offset.add(trip(0, 50, 1_000, 1_000)));
        assert!(offset.add(trip(10_000, 50, 9_000, 9_000)));
        assert!(offset.at(20_000).expect("two").bound < 1_100);
        // 100 ppm of a second are 100 µs: the bound grows.
        assert!(offset.at(1_000_000_000).expect("two").bound > 100_000);
    }

    #[test]
    fn impossible_times_are_no_round_trip() {
        let mut offset = Offset::default();
        let good = trip(0, 50, 1_000, 1_000);
        for bad in [
            RoundTrip {
                returned: -1,
                ..good
            },
            RoundTrip {
                answered: good.arrived - 1,
                ..good
            },
            // The reply was on its way for longer than the whole took.
            RoundTrip {
                answered: good.answered + 9_000,
                ..good
            },
            RoundTrip {
                arrived: Nanos::MIN,
                answered: Nanos::MAX,
                ..good
            },
        ] {
            assert!(!offset.add(bad), "{bad:?}");
        }
        assert_eq!(offset.at(0), None);
    }
}
