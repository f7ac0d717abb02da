//! What the clock must do.

use mend_it::run;

const SECOND: u64 = 1_000_000_000;

/// All ticks until `end` (ns): the node and the time (ns).
fn ticks<const NODES: usize>(hz: [u64; NODES], end: u64) -> Vec<(usize, u64)> {
    let mut ticks = Vec::new();
    run(hz, end, |node, now| {
        ticks.push((node, now));
        true
    });
    ticks
}

#[test]
fn every_node_ticks_as_often_in_a_second_as_its_rate_says() {
    for hz in [1, 5, 7, 12, 25, 30, 50] {
        // The first tick is at zero, the last after exactly a second.
        let ticks = ticks([hz], SECOND);
        assert_eq!(ticks.len() as u64, hz + 1, "{hz} Hz");
        assert_eq!(ticks.last(), Some(&(0, SECOND)), "{hz} Hz");
    }
}

#[test]
fn nodes_that_are_due_together_tick_at_the_same_instant_and_in_order() {
    for hz in [10, 12, 15, 25, 30] {
        let ticks = ticks([50, hz, 50], 10 * SECOND);
        // In a whole second everybody is due.
        for second in 0..=10 {
            let now = second * SECOND;
            let at = ticks.iter().filter(|(_, at)| *at == now);
            let nodes: Vec<usize> = at.map(|(node, _)| *node).collect();
            assert_eq!(nodes, [0, 1, 2], "{hz} Hz, at {second} s");
        }
    }
}

#[test]
fn time_never_goes_back_and_ends_when_it_is_told() {
    let mut left = 100;
    let mut last = 0;
    run([50, 30, 50], 10 * SECOND, |_, now| {
        assert!(now >= last);
        last = now;
        left -= 1;
        left > 0
    });
    assert_eq!(left, 0);
}
