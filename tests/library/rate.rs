//! Exact time: the due time of tick k, the effect of a change of rate, and the valid
//! rates and times.

use proptest::prelude::*;

use crate::support::*;

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
        let now = last + hz(before as f64 / 1e6).period().mul_f64(busy);
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

const NO_NUMBERS: [f64; 5] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0, f64::MAX];

#[test]
fn an_invalid_rate_time_or_speed_is_refused_with_value_and_range() {
    for wrong in "NaN inf -inf 0 -0 -50 1e-9 0.0009 10001 1e300 fast ".split(' ') {
        let error = wrong.parse::<Hz>().expect_err(wrong).to_string();
        let expected = format!("{wrong:?} is not a rate: expected 0.001 to 10000 ticks per second");
        assert_eq!(error, expected);
    }
    for wrong in NO_NUMBERS.into_iter().chain([0.0]) {
        let error = Hz::new(wrong).expect_err("refused").to_string();
        assert!(
            error.contains(&wrong.to_string()) && error.contains("0.001 to 10000"),
            "{error}"
        );
    }
    for wrong in NO_NUMBERS.into_iter().chain([-1e-3, 1e11]) {
        let error = Time::from_secs_f64(wrong).expect_err("refused").to_string();
        let expected = "is not a time: expected seconds, zero or more, up to 584 years";
        assert_eq!(error, format!("{wrong} {expected}"));
    }
    for wrong in NO_NUMBERS.into_iter().chain([0.0, 0.09, 100.1]) {
        let error = Speed::times(wrong).expect_err("refused").to_string();
        let expected = "is not a speed: expected 0.1 to 100 times that of the wall's clock";
        assert_eq!(error, format!("{wrong} {expected}"));
    }
}

#[test]
fn the_slowest_and_the_fastest_of_each_are_accepted() {
    assert_eq!(Hz::new(0.001), Ok(Hz::MIN));
    assert_eq!(Hz::new(10_000.0), Ok(Hz::MAX));
    assert_eq!(" 33.3 ".parse(), Hz::new(33.3));
    assert_eq!(Depth::new(1), Ok(Depth::ONE));
    assert_eq!(Depth::new(1_000_000), Ok(Depth::MAX));
    assert!(Depth::new(0).is_err() && Depth::new(1_000_001).is_err());
    assert!(Speed::times(0.1).is_ok() && Speed::times(100.0).is_ok());
    assert_eq!(Speed::times(1.0), Ok(Speed::REAL_TIME));
}

#[test]
fn times_saturate_instead_of_wrapping() {
    assert_eq!(Time::MAX + Time::RESOLUTION, Time::MAX);
    assert!(Time::ZERO.since(secs(1.0)).is_zero());
    assert!((Time::ZERO - secs(1.0)).is_zero());
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
