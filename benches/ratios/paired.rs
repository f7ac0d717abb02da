//! Paired measurements: two things measured in turns.

use std::time::{Duration, Instant};

/// Nanoseconds, in fractions that a `Duration` cannot hold.
pub type Nanos = f64;

/// The medians of a number of rounds.
pub struct Paired {
    pub ours: Nanos,
    pub floor: Nanos,
    /// Ours over the floor, round by round.
    pub ratio: f64,
}

/// Lets both work in every round, in alternating order, after one round that
/// does not count.
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

/// How long `work` takes.
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
