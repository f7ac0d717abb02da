//! The promises of a rate.

use build_it::Rate;

const SECOND: u64 = 1_000_000_000;

/// The due time of tick `tick` at `hz` (ns).
fn due(hz: u64, tick: u64) -> u64 {
    let mut rate = Rate::new(hz);
    (0..tick).for_each(|_| rate.advance());
    rate.due()
}

#[test]
fn the_first_tick_is_due_at_once() {
    assert_eq!(due(50, 0), 0);
}

#[test]
fn ticks_come_at_the_rate() {
    assert_eq!(due(50, 1), SECOND / 50);
    assert_eq!(due(50, 7), 7 * SECOND / 50);
}

#[test]
fn a_period_that_is_no_whole_number_is_rounded_down_and_adds_up_to_nothing() {
    assert_eq!(
        [due(3, 1), due(3, 2), due(3, 3)],
        [333_333_333, 666_666_666, SECOND]
    );
    for hz in [7, 12, 15, 30, 33] {
        assert_eq!(
            due(hz, 3_600 * hz),
            3_600 * SECOND,
            "{hz} Hz, after an hour"
        );
    }
}

#[test]
fn rates_that_ought_to_tie_do() {
    for second in 1..60 {
        assert_eq!(due(50, 50 * second), due(30, 30 * second));
    }
}

#[test]
fn to_look_is_not_to_move() {
    let rate = Rate::new(10);
    assert_eq!(rate.due(), rate.due());
}
