//! Paired measurements: two operations measured alternately.

use std::time::{Duration, Instant};

/// Nanoseconds, with fractions beyond the resolution of a `Duration`.
pub type Nanos = f64;

/// The medians over a number of rounds.
pub struct Paired {
    pub ours: Nanos,
    pub floor: Nanos,
    /// Median of the ratio of this project's time to the floor's, by round.
    pub ratio: f64,
}

/// Runs both in every round, in alternating order, after one warm-up round.
pub fn paired(
    rounds: usize,
    mut ours: impl FnMut() -> Nanos,
    mut floor: impl FnMut() -> Nanos,
) -> Paired {
    let mut round = |number: usize| {
        if number.is_multiple_of(2) {
            let ours = ours();
            (ours, floor())
        } else {
            let floor = floor();
            (ours(), floor)
        }
    };
    round(0);
    let times: Vec<_> = (0..rounds).map(round).collect();
    Paired {
        ours: median(times.iter().map(|(ours, _)| *ours)),
        floor: median(times.iter().map(|(_, floor)| *floor)),
        ratio: median(times.iter().map(|(ours, floor)| ours / floor)),
    }
}

/// Duration of `work`.
pub fn time(work: impl FnOnce()) -> Nanos {
    let began = Instant::now();
    work();
    nanos(began.elapsed())
}

/// A duration as a number.
pub fn nanos(duration: Duration) -> Nanos {
    duration.as_secs_f64() * 1e9
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
