//! The age of the push in force: its mean is over time, and so is that of its last second.

use crate::support::*;

#[test]
fn a_push_after_the_reading_leaves_the_last_second_as_it_is() {
    let mut pushes = PushAge::default();
    for ms in (0..5_000).step_by(20) {
        pushes.push(at_ms(ms), at_ms(ms));
    }
    let before = pushes.lately(at_ms(4_985));
    pushes.push(at_ms(5_001), at_ms(5_001));
    let after = pushes.lately(at_ms(4_985));
    let [before, after] = [before, after].map(|late| late.expect("a mean").mean_s);
    assert!(
        after < 0.021 && (before - after).abs() < 0.005,
        "{before} {after}"
    );
}

#[test]
fn the_mean_is_over_time_and_not_over_pushes() {
    let mut age = PushAge::default();
    assert_eq!((age.saw(), age.lately(at_ms(1))), (None, None));
    age.push(at_ms(10), at_ms(0)); // 10 to 30 ms old for 20 ms,
    age.push(at_ms(20), at_ms(0)); // unchanged by applying it again,
    age.push(at_ms(30), at_ms(30)); // then 0 to 10 ms old for 10 ms.
    let saw = age.saw().expect("pushes");
    assert_eq!(saw.age(at_ms(40)), ms(10));
    let mean = (20.0 * 20.0 + 10.0 * 5.0) / 30.0 / 1e3;
    assert!((saw.mean_s(at_ms(40)).expect("time passed") - mean).abs() < 1e-15);
    let late = age.lately(at_ms(40)).map(|late| late.mean_s);
    assert_eq!(late, saw.mean_s(at_ms(40)));
    // The run ended before the last push: the age goes on until that.
    assert_eq!(saw.mean_s(at_ms(25)), saw.mean_s(at_ms(30)));
}

#[test]
fn the_last_second_begins_in_the_middle_of_a_push() {
    let mut age = PushAge::default();
    age.push(at_ms(0), at_ms(0)); // 0 to 600 ms old, then
    age.push(at_ms(600), at_ms(600)); // 0 to 1000 ms old.
    for (now, mean, greatest) in [
        (600, 0.3, 600),
        (1_200, 0.4 * 0.4 + 0.6 * 0.3, 600),
        (1_600, 0.5, 1_000),
        (1_700, 0.6, 1_100),
    ] {
        let late = age.lately(at_ms(now)).expect("time passed");
        assert!((late.mean_s - mean).abs() < 1e-15, "{late:?} at {now}");
        assert_eq!(late.greatest, ms(greatest), "at {now}");
    }
}
