//! Run times and the clock behind them, and how far the clock of another machine is ahead of ours,
//! with rigorous bounds.
//!
//! A query leaves at `t1`, arrives at `t2`, the reply leaves at `t3` and arrives at `t4`;
//! `t2` and `t3` are read from the other clock. No message arrives before it leaves, so the
//! other clock is ahead by at least `t3 - t4` and by at most `t2 - t1`: half the round trip
//! either way of the middle, however uneven the two ways are.

use std::{
    collections::{HashMap, VecDeque},
    mem,
    sync::{Arc, Mutex, OnceLock},
};

use ratelab::{Time, clock::RunWriter, sync::lock};
use ratelab_metrics::Observer;

use crate::{
    machine::{self, ClockId, ClockMoment, Nanos},
    sender::Refusal,
};

/// Round trips that are kept.
const MAX_TRIPS: usize = 16;

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

    /// Returns the moment of our clock at `theirs` of the other one.
    pub fn ours(self, theirs: Nanos) -> Nanos {
        theirs.saturating_sub(self.ahead)
    }

    /// By how much more the other clock is ahead at `later`, if the bounds rule out that
    /// it is the same.
    fn step_to(self, later: Self) -> Option<Nanos> {
        let step = later.ahead.saturating_sub(self.ahead);
        let bound = self.bound.saturating_add(later.bound);
        (step.saturating_abs() > bound).then_some(step)
    }
}

impl RoundTrip {
    /// Returns the estimate from this round trip alone, at `now`; `None` if its times are
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
    /// Adds a round trip. Where it contradicts the earlier ones, one of the clocks was set:
    /// those are forgotten, and the step of the other clock against ours is returned (ns).
    /// All are forgotten where its times are those of no round trip: a clock was set on the way.
    pub fn add(&mut self, trip: RoundTrip) -> Option<Nanos> {
        let possible = trip.returned >= trip.left && trip.answered >= trip.arrived;
        let Some(new) = trip.estimate(trip.returned).filter(|_| possible) else {
            self.0.clear();
            return None;
        };
        let known = self.at(trip.returned);
        let step = known.and_then(|known| known.step_to(new));
        if step.is_some() {
            self.0.clear();
        }
        self.0.push_back(trip);
        if self.0.len() > MAX_TRIPS {
            self.0.pop_front();
        }
        step
    }

    /// Returns the estimate with the least bound at `now`; `None` before the first.
    pub fn at(&self, now: Nanos) -> Option<Estimate> {
        self.0
            .iter()
            .filter_map(|trip| trip.estimate(now))
            .min_by_key(|estimate| estimate.bound)
    }
}

/// How far the clocks of all other machines are ahead of ours.
#[derive(Debug, Default)]
pub struct Offsets {
    clocks: Mutex<HashMap<ClockId, Offset>>,
    /// Steps of clocks that nobody has taken note of yet (ns).
    steps: Mutex<Vec<(ClockId, Nanos)>>,
}

impl Offsets {
    /// Returns how far `clock` is ahead of ours; `None` while unknown.
    pub fn estimate(&self, clock: ClockId) -> Option<Estimate> {
        if clock == ClockId::here() {
            return Some(Estimate::SAME);
        }
        lock(&self.clocks).get(&clock)?.at(machine::now())
    }

    /// Adds a round trip to `clock`.
    pub fn add(&self, clock: ClockId, trip: RoundTrip) {
        let step = lock(&self.clocks).entry(clock).or_default().add(trip);
        lock(&self.steps).extend(step.map(|step| (clock, step)));
    }

    /// Returns the steps of other clocks against ours (ns) since the last call.
    pub fn take_steps(&self) -> Vec<(ClockId, Nanos)> {
        mem::take(&mut lock(&self.steps))
    }
}

/// Converts between the run time of this process and the clocks of all.
pub struct Times {
    /// Reads the run.
    pub(crate) observer: Observer,
    /// Logs what is heard of other processes.
    pub(crate) run: RunWriter,
    /// The moment of run time zero, once known.
    zero: OnceLock<Nanos>,
    pub(crate) offsets: Arc<Offsets>,
    /// Whether clocks of the graph are wrong by its settings: stamps may be from the future or from
    /// before the run then.
    wrong_clocks: bool,
    /// Times of this run and the moments that they came from.
    origins: Recent<Time, ClockMoment>,
}

impl Times {
    /// Creates the times of the run that `observer` reads and `run` writes, with `wrong_clocks` or
    /// without.
    pub(crate) fn new(
        observer: Observer,
        run: RunWriter,
        offsets: Arc<Offsets>,
        wrong_clocks: bool,
    ) -> Self {
        Self {
            observer,
            run,
            zero: OnceLock::new(),
            offsets,
            wrong_clocks,
            origins: Recent::default(),
        }
    }

    /// Returns the moment of run time zero, by our clock; `None` before the run.
    pub fn zero(&self) -> Option<Nanos> {
        self.zero.get().copied().or_else(|| {
            let zero = machine::moment_of(self.observer.zero()?);
            Some(*self.zero.get_or_init(|| zero))
        })
    }

    /// Returns the run time now; `None` before the run.
    pub(crate) fn now(&self) -> Option<Time> {
        let passed = machine::now().saturating_sub(self.zero()?);
        u64::try_from(passed).ok().map(Time::from_nanos)
    }

    /// Returns the moment of run time `time`; `None` before the run.
    pub(crate) fn moment(&self, time: Time) -> Option<ClockMoment> {
        let passed = Nanos::try_from(time.as_nanos()).ok()?;
        Some(ClockMoment {
            clock: ClockId::here(),
            at: self.zero()?.checked_add(passed)?,
        })
    }

    /// Returns the run time of `moment`; with wrong clocks as they stamp it, zero before the run.
    ///
    /// # Errors
    /// [`Refusal`] if its clock is unknown, or it is before the run or in the future without a wrong
    /// clock.
    pub(crate) fn time(&self, moment: ClockMoment) -> Result<Time, Refusal> {
        let zero = self.zero().ok_or(Refusal::Early)?;
        let estimate = self.offsets.estimate(moment.clock).ok_or(Refusal::Clock)?;
        let (ours, now) = (estimate.ours(moment.at), machine::now());
        if self.wrong_clocks {
            let shown = self.passed(moment)?.max(0);
            return Ok(Time::from_nanos(shown.unsigned_abs()));
        }
        if ours.saturating_sub(now) > estimate.bound {
            return Err(Refusal::Future);
        }
        let passed = ours.min(now).saturating_sub(zero);
        let passed = u64::try_from(passed).map_err(|_| Refusal::Early)?;
        Ok(Time::from_nanos(passed))
    }

    /// Returns the run time of `moment` (ns), negative before the run.
    ///
    /// # Errors
    /// [`Refusal`] before the run, and if the clock is unknown.
    pub(crate) fn passed(&self, moment: ClockMoment) -> Result<Nanos, Refusal> {
        let zero = self.zero().ok_or(Refusal::Early)?;
        let estimate = self.offsets.estimate(moment.clock).ok_or(Refusal::Clock)?;
        Ok(estimate.ours(moment.at).saturating_sub(zero))
    }

    /// Remembers that run time `time` came from `moment`.
    pub(crate) fn remember(&self, time: Time, moment: ClockMoment) {
        self.origins.keep(time, moment);
    }

    /// Returns the moment that run time `time` came from lately, or else is.
    pub(crate) fn origin(&self, time: Time) -> Option<ClockMoment> {
        self.origins
            .find(|known, _| *known == time)
            .map(|(_, moment)| moment)
            .or_else(|| self.moment(time))
    }
}

/// Pairs that are kept: seconds at usual rates.
const MAX_PAIRS: usize = 1024;

/// The newest pairs.
#[derive(Debug)]
pub(crate) struct Recent<A, B>(Mutex<VecDeque<(A, B)>>);

impl<A, B> Default for Recent<A, B> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<A: Copy, B: Copy> Recent<A, B> {
    /// Keeps a pair.
    pub(crate) fn keep(&self, a: A, b: B) {
        let mut pairs = lock(&self.0);
        pairs.push_back((a, b));
        if pairs.len() > MAX_PAIRS {
            pairs.pop_front();
        }
    }

    /// Returns the newest pair that is `wanted`.
    pub(crate) fn find(&self, wanted: impl Fn(&A, &B) -> bool) -> Option<(A, B)> {
        let pairs = lock(&self.0);
        pairs.iter().rev().find(|(a, b)| wanted(a, b)).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A round trip at `left` to a clock that is `ahead`, with these delays.
    fn trip(left: Nanos, ahead: Nanos, there: Nanos, back: Nanos) -> RoundTrip {
        let arrived = left + there + ahead;
        let answered = arrived + 7;
        RoundTrip {
            left,
            arrived,
            answered,
            returned: answered - ahead + back,
        }
    }

    #[test]
    fn the_true_offset_is_within_the_bound_however_uneven_the_ways() {
        for ahead in [-5_000_000_000, -3, 0, 1, 9_000_000_000_000] {
            let mut offset = Offset::default();
            for (there, back) in [(900_000, 20), (10, 400_000), (60_000, 70_000), (0, 0)] {
                assert_eq!(offset.add(trip(1_000, ahead, there, back)), None);
                let found = offset.at(1_000_000).expect("a round trip");
                assert!((found.ahead - ahead).abs() <= found.bound, "{found:?}");
            }
        }
    }

    #[test]
    fn the_least_round_trip_counts_until_drift_has_eaten_its_lead() {
        let mut offset = Offset::default();
        assert_eq!(offset.add(trip(0, 50, 1_000, 1_000)), None);
        assert_eq!(offset.add(trip(10_000, 50, 9_000, 9_000)), None);
        assert!(offset.at(20_000).expect("two").bound < 1_100);
        // 100 ppm of a second are 100 µs: the bound grows.
        assert!(offset.at(1_000_000_000).expect("two").bound > 100_000);
    }

    #[test]
    fn impossible_times_are_no_round_trip() {
        let good = trip(0, 50, 1_000, 1_000);
        let with = |arrived, answered, returned| RoundTrip {
            arrived,
            answered,
            returned,
            ..good
        };
        for bad in [
            with(good.arrived, good.answered, -1),
            with(good.arrived, good.arrived - 1, good.returned),
            // The reply was on its way for longer than the whole took.
            with(good.arrived, good.answered + 9_000, good.returned),
            with(Nanos::MIN, Nanos::MAX, good.returned),
        ] {
            let mut offset = Offset::default();
            assert_eq!((offset.add(good), offset.add(bad)), (None, None));
            assert_eq!(offset.at(0), None, "{bad:?}");
        }
    }

    #[test]
    fn a_clock_that_was_set_is_noticed_at_the_next_round_trip() {
        const SECOND: Nanos = 1_000_000_000;
        for step in [SECOND, -SECOND, 3_000_000] {
            let mut offset = Offset::default();
            for beat in 0..4 {
                let steady = offset.add(trip(beat * SECOND / 4, 50, 90_000, 20_000));
                assert_eq!(steady, None);
            }
            let found = offset.add(trip(SECOND, 50 + step, 60_000, 60_000));
            let found = found.expect("a step");
            // The bounds of both estimates, of which the first has drifted for a moment.
            assert!((found - step).abs() < 200_000, "{found} for {step}");
            // The new offset counts at once, and alone.
            let now = offset.at(SECOND + 1_000_000).expect("the last trip");
            assert!((now.ahead - 50 - step).abs() <= now.bound, "{now:?}");
            let next = trip(2 * SECOND, 50 + step, 90_000, 20_000);
            assert_eq!(offset.add(next), None);
        }
    }
}
