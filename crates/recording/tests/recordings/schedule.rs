//! The ticks of a node on the virtual clock are where its rates have them.

use ratelab::{ClockKind, Time};
use ratelab_metrics::{TickCauses, TickRecord};

use super::{
    given::{GivenRun, node},
    ms, turned_rate,
};

/// The defect of a recording with these ticks of the policy up to `end`: 50 Hz, then 10 Hz from
/// 0.5 s on, with the knobs in `setup`.
fn defect(setup: &str, ticks: impl Iterator<Item = (u64, Time)>, end: Time) -> Option<String> {
    let tick = |(number, at)| TickRecord {
        number,
        at,
        ends: None,
        lateness: None,
        took: None,
        overruns: 0,
        push: None,
        causes: TickCauses::default(),
    };
    let run = GivenRun {
        clock: ClockKind::Virtual,
        setup,
        nodes: vec![node("policy")],
        ticks: ticks.map(|row| (0, tick(row))).collect(),
        events: vec![turned_rate(ms(500), "policy", 10.0)],
        end,
    };
    run.recorded().defect()
}

/// Ticks `0..count` at 50 Hz, then one at each of `later` (ms).
fn ticks(count: u64, later: &[u64]) -> impl Iterator<Item = (u64, Time)> {
    let regular = (0..count).map(|number| number * 20);
    (0..).zip(regular.chain(later.iter().copied()).map(ms))
}

#[test]
fn ticks_are_where_the_rates_have_them_and_none_rests_for_longer() {
    // The ticks from 0.5 s on, due at 0.58 s, 0.68 s and so on, and the end (ms): a count may
    // be wrong by one, and by one more for the change of the rate.
    for (later, end, whole) in [
        (
            &[580, 680, 780, 880, 980, 1080, 1180, 1280, 1380, 1480, 1580][..],
            1580,
            true,
        ),
        (&[580, 581, 582, 583], 583, true),
        (&[580, 581, 582, 583, 584], 584, false),
        (&[580, 880], 880, true),
        (&[580, 981], 981, false),
        (&[580], 680, true),
        (&[580], 880, true),
        (&[580], 881, false),
        (&[580], 10_000, false),
    ] {
        let defect = defect("", ticks(25, later), ms(end));
        assert_eq!(defect.is_none(), whole, "{later:?}, {end}: {defect:?}");
    }
    assert!(defect("", ticks(26, &[]), Time::MAX).is_some());
    let late = ms(1_000_000_000_000);
    let far = ticks(25, &[]).chain([(1 << 62, late)]);
    assert!(defect("", far, late).is_some());
}

#[test]
fn ticks_that_take_time_may_be_fewer_and_never_more() {
    let slow = || (0..9).map(|number| (number, ms(number * 60)));
    for (ticks, end, whole) in [
        (slow().collect::<Vec<_>>(), 480, true),
        (slow().collect(), 10_000, true),
        (ticks(25, &[490, 491, 492]).collect(), 492, true),
        (ticks(25, &[490, 491, 492, 493]).collect(), 493, false),
    ] {
        let last = ticks.last().copied();
        let defect = defect("takes policy 60", ticks.into_iter(), ms(end));
        assert_eq!(defect.is_none(), whole, "{last:?}, {end}: {defect:?}");
    }
}
