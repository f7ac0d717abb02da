//! A fixed rate: the due time of tick *k*.

use std::time::Duration;

use crate::time::{Hz, Time};

/// The promise that a node ticks at a fixed rate: tick *k* is due at
/// `anchor + k / f`, rounded down to a nanosecond.
///
/// The due time is computed by multiplication from an anchor, never by adding a period
/// again and again, so it cannot drift, and two rates whose ticks coincide agree on the
/// instant to the nanosecond:
///
/// ```
/// use ratelab::{Hz, Rate, Time};
///
/// let mut fast = Rate::new(Hz::new(50.0)?, Time::ZERO);
/// let mut slow = Rate::new(Hz::new(15.0)?, Time::ZERO);
/// (0..10).for_each(|_| fast.advance());
/// (0..3).for_each(|_| slow.advance());
/// assert_eq!(fast.due(), slow.due()); // 0.2 s, exactly
/// # Ok::<(), ratelab::HzError>(())
/// ```
///
/// A rate can be changed while it runs. The new rate is anchored at the last due time,
/// which avoids both bursts and gaps:
///
/// | the rate was | changed at | to | next due |
/// |---|---|---|---|
/// | never ticked, anchored at 0 | 0 s | any | 0 s |
/// | 50 Hz, last due 1.00 s | 1.01 s | 10 Hz | 1.10 s |
/// | 10 Hz, last due 1.00 s | 1.01 s | 50 Hz | 1.02 s |
/// | 1 Hz, last due 1.00 s | 1.51 s | 50 Hz | 1.52 s, not 26 ticks at once |
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Rate {
    hz: Hz,
    period: Period,
    anchor: Time,
    /// Number of the next tick, counted from the anchor.
    next: u64,
    due: Time,
    last: Option<Time>,
    /// Number of the first tick.
    first: u64,
}

impl Rate {
    /// Creates a rate of `hz` whose first tick is due at `first`.
    pub fn new(hz: Hz, first: Time) -> Self {
        Self {
            hz,
            period: Period::new(hz),
            anchor: first,
            next: 0,
            due: first,
            last: None,
            first: 0,
        }
    }

    /// Delays the first tick by one period, as a timer of ROS does.
    pub(crate) fn skip_first(&mut self) {
        self.first = 1;
        self.schedule(self.next.max(self.first));
    }

    /// Returns the rate in force.
    pub fn hz(&self) -> Hz {
        self.hz
    }

    /// Returns when the next tick is due.
    #[inline]
    pub fn due(&self) -> Time {
        self.due
    }

    /// Due time of the period before the next tick, kept or skipped; `None` before the
    /// first.
    pub fn last_due(&self) -> Option<Time> {
        self.last
    }

    /// Moves on to the next tick.
    #[inline]
    pub fn advance(&mut self) {
        self.last = Some(self.due);
        self.schedule(self.next + 1);
    }

    /// Moves on to the first tick that is due at `now` or later and returns the number of
    /// skipped ticks.
    ///
    /// This prevents a burst after an overrun: periods that passed while a node was busy
    /// are skipped. A timer in ROS skips them too, except for one late call.
    pub fn advance_past(&mut self, now: Time) -> u64 {
        let successor = self.next + 1;
        let next = self.first_at_or_after(now).max(successor);
        self.last = Some(self.period.due(self.anchor, next - 1));
        self.schedule(next);
        next - successor
    }

    /// Changes the rate at `now`, anchored at the last due time.
    pub fn set_hz(&mut self, hz: Hz, now: Time) {
        self.set_hz_while_busy(hz, now, now);
    }

    /// Changes the rate at `now` for a node that is busy until `free`: its next tick is due then
    /// at the earliest.
    pub(crate) fn set_hz_while_busy(&mut self, hz: Hz, now: Time, free: Time) {
        self.hz = hz;
        self.period = Period::new(hz);
        self.anchor = self.last.unwrap_or(self.anchor);
        let earliest = u64::from(self.last.is_some()).max(self.first);
        let next = self.first_at_or_after(now).max(earliest);
        if let Some(before) = next.checked_sub(1) {
            self.last = Some(self.period.due(self.anchor, before));
        }
        self.schedule(next.max(self.first_at_or_after(free)));
    }

    /// Restarts the sequence of due times at run time zero, shifted by `offset`. The next
    /// tick is due at `free` at the earliest.
    pub(crate) fn set_offset(&mut self, offset: Duration, free: Time) {
        self.anchor = Time::ZERO + offset;
        self.resume(free);
    }

    /// Moves forward or back to the first tick that is due at `free` or later.
    pub fn resume(&mut self, free: Time) {
        self.schedule(self.first_at_or_after(free));
    }

    fn first_at_or_after(&self, time: Time) -> u64 {
        let elapsed = time.since(self.anchor);
        let elapsed = u64::try_from(elapsed.as_nanos()).unwrap_or(u64::MAX);
        self.period.ticks_until(elapsed).max(self.first)
    }

    #[inline]
    fn schedule(&mut self, tick: u64) {
        self.next = tick;
        self.due = self.period.due(self.anchor, tick);
    }
}

/// One period in nanoseconds as a reduced fraction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Period {
    numerator: u64,
    denominator: u64,
}

impl Period {
    /// Nanoseconds in a second times microhertz in a hertz.
    const NANOS_TIMES_MICRO: u64 = 1_000_000_000_000_000;

    fn new(hz: Hz) -> Self {
        let divisor = greatest_common_divisor(Self::NANOS_TIMES_MICRO, hz.as_micro());
        Self {
            numerator: Self::NANOS_TIMES_MICRO / divisor,
            denominator: hz.as_micro() / divisor,
        }
    }

    #[inline]
    fn due(self, anchor: Time, tick: u64) -> Time {
        Time::from_nanos(anchor.as_nanos().saturating_add(self.offset(tick)))
    }

    /// `tick` periods in nanoseconds, rounded down.
    #[inline]
    fn offset(self, tick: u64) -> u64 {
        match tick.checked_mul(self.numerator) {
            // Most rates divide a second evenly; this avoids a division, which costs as
            // much as the rest of the schedule.
            Some(product) if self.denominator == 1 => product,
            Some(product) => product / self.denominator,
            None => {
                let product = u128::from(tick) * u128::from(self.numerator);
                u64::try_from(product / u128::from(self.denominator)).unwrap_or(u64::MAX)
            }
        }
    }

    /// Returns the first tick whose offset is `elapsed` nanoseconds or more.
    fn ticks_until(self, elapsed: u64) -> u64 {
        let product = u128::from(elapsed) * u128::from(self.denominator);
        u64::try_from(product.div_ceil(u128::from(self.numerator))).unwrap_or(u64::MAX)
    }
}

/// Returns the interval after which nodes with these rates, once due together, are due together
/// again: the least common multiple of their periods, rounded down to a nanosecond. Zero
/// for no rates.
pub fn hyper_period(rates: impl IntoIterator<Item = Hz>) -> Duration {
    let common = rates
        .into_iter()
        .map(Hz::as_micro)
        .fold(0, greatest_common_divisor);
    let nanos = Period::NANOS_TIMES_MICRO.checked_div(common);
    Duration::from_nanos(nanos.unwrap_or(0))
}

fn greatest_common_divisor(a: u64, b: u64) -> u64 {
    if b == 0 {
        a
    } else {
        greatest_common_divisor(b, a % b)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn hz(hz: f64) -> Hz {
        Hz::new(hz).expect("a rate")
    }

    /// Nanoseconds in a second times microhertz in a hertz.
    const NANOS_TIMES_MICRO: u128 = 1_000_000_000_000_000;

    fn micro_hz(micro: u64) -> Hz {
        hz(micro as f64 / 1e6)
    }

    fn rates() -> impl Strategy<Value = u64> {
        prop_oneof![
            1_000..=10_000_000_000_u64,
            1_000..=1_000_000_u64,
            (1..=10_000_u64).prop_map(|hertz| hertz * 1_000_000),
        ]
    }

    /// The due time of tick `tick` at `micro` microhertz, from first principles.
    fn due(micro: u64, tick: u64) -> Time {
        let nanos = u128::from(tick) * NANOS_TIMES_MICRO / u128::from(micro);
        Time::from_nanos(nanos.try_into().expect("within 584 years"))
    }

    proptest! {
        #[test]
        fn tick_k_is_due_k_periods_after_the_anchor_rounded_down(
            micro in rates(),
            anchor in 0..1u64 << 50,
            ticks in 1..200u64,
        ) {
            let mut rate = Rate::new(micro_hz(micro), Time::from_nanos(anchor));
            for tick in 0..ticks {
                let offset = due(micro, tick).as_nanos();
                prop_assert_eq!(rate.due().as_nanos(), anchor + offset);
                rate.advance();
            }
        }

        #[test]
        fn moving_past_a_moment_skips_exactly_the_ticks_before_it(
            (micro, now) in rates().prop_flat_map(|micro| {
                // Also right now.
                let on_grid = (1..1_000u64).prop_map(move |tick| due(micro, tick));
                (Just(micro), prop_oneof![(0..1u64 << 50).prop_map(Time::from_nanos), on_grid])
            }),
        ) {
            let mut rate = Rate::new(micro_hz(micro), Time::ZERO);
            let skipped = rate.advance_past(now);
            let next = skipped + 1;
            prop_assert_eq!(rate.due(), due(micro, next));
            prop_assert!(rate.due() >= now);
            prop_assert!(skipped == 0 || due(micro, next - 1) < now);
        }

        #[test]
        fn a_changed_rate_is_due_neither_in_the_past_nor_after_a_gap(
            (before, after) in (rates(), rates()),
            ticks in 1..100u64,
            busy in 0.0..5.0f64,
        ) {
            let mut rate = Rate::new(micro_hz(before), Time::ZERO);
            (0..ticks).for_each(|_| rate.advance());
            let last = due(before, ticks - 1);
            let now = last + micro_hz(before).period().mul_f64(busy);
            rate.set_hz(micro_hz(after), now);
            prop_assert_eq!(rate.hz(), micro_hz(after));
            prop_assert!(rate.due() >= now);
            prop_assert!(rate.due() > last);
            let period = due(after, 1) + Time::RESOLUTION;
            prop_assert!(rate.due() <= now + period.since(Time::ZERO));
            prop_assert!(on_grid(after, last, rate.due()), "anchored elsewhere");
        }
    }

    /// Whether `time` is a whole number of periods after `anchor`.
    fn on_grid(micro: u64, anchor: Time, time: Time) -> bool {
        let elapsed = time.since(anchor).as_nanos();
        let tick = (elapsed * u128::from(micro)).div_ceil(NANOS_TIMES_MICRO);
        due(micro, tick.try_into().expect("small")).since(Time::ZERO) == time.since(anchor)
    }

    #[test]
    fn a_new_rate_before_the_first_tick_is_due_at_once() {
        for new in [0.001, 10.0, 10_000.0] {
            let mut rate = Rate::new(hz(50.0), Time::ZERO);
            rate.set_hz(hz(new), Time::ZERO);
            assert_eq!((rate.due(), rate.last_due()), (Time::ZERO, None));
        }
    }

    #[test]
    fn nodes_that_are_due_together_are_due_together_again_after_a_hyper_period() {
        for (rates, seconds) in [
            (&[50.0][..], 0.02),
            (&[50.0, 50.0, 10.0], 0.1),
            (&[50.0, 8.0], 0.5),
            (&[50.0, 7.0], 1.0),
            (&[33.3, 50.0], 10.0),
            (&[], 0.0),
        ] {
            let period = hyper_period(rates.iter().map(|&rate| hz(rate)));
            assert_eq!(period.as_secs_f64(), seconds, "{rates:?}");
        }
    }
}
