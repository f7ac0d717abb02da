//! Guesses by timing alone, where no stamps tell who reads what. They are not more than that.

use crate::{
    numbers::{median, quantile, spread, steps},
    stamps::{TopicEvents, is_at_once},
};

/// A topic that another one seems to follow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guess {
    /// The topic that is followed.
    pub parent: usize,
    /// The topic that follows it.
    pub child: usize,
    /// How well the steps agree, up to 1.
    pub correlation: f64,
}

/// Returns the best guess of what the topic `b` follows, among all others of `series`.
pub fn guess(series: &[TopicEvents], b: usize) -> Option<Guess> {
    let others = (0..series.len()).filter(|a| *a != b);
    let followed = others.filter_map(|a| {
        let (spread, correlation) = followed(&series[a], &series[b])?;
        let guess = Guess {
            parent: a,
            child: b,
            correlation,
        };
        Some((spread, guess))
    });
    followed
        .min_by_key(|(spread, _)| *spread)
        .map(|(_, guess)| guess)
}

/// Returns the spread of the delays and the correlation of the steps, where `b` follows `a`.
fn followed(a: &TopicEvents, b: &TopicEvents) -> Option<(i64, f64)> {
    let (of_a, of_b) = (a.events.len(), b.events.len());
    if of_a < 40 || !(0.9..=1.05).contains(&(of_b as f64 / of_a as f64)) {
        return None;
    }
    let mut pairs = Vec::with_capacity(of_b);
    for event in &b.events {
        let newest = a.events.partition_point(|other| other < event);
        pairs.extend(newest.checked_sub(1).map(|place| (place, *event)));
    }
    let delays: Vec<i64> = pairs
        .iter()
        .map(|(place, event)| event - a.events[*place])
        .collect();
    let middle_a = quantile(&mut steps(&a.events), 500);
    let middle_b = quantile(&mut steps(&b.events), 500);
    let width = spread(&mut delays.clone());
    let delay = median(delays);
    let are_together = is_at_once(delay, width, a.has_source && b.has_source);
    if width as f64 > 0.4 * middle_a as f64 || are_together {
        return None;
    }
    let neighbours: Vec<(f64, f64)> = pairs
        .windows(2)
        .filter_map(|pair| {
            let [(before, at), (place, then)] = [pair[0], pair[1]];
            let step_a = a.events[place] - a.events[before];
            let step_b = then - at;
            let is_usual = |step: i64, middle: i64| (step as f64) < 1.8 * middle as f64;
            let fits =
                place == before + 1 && is_usual(step_a, middle_a) && is_usual(step_b, middle_b);
            fits.then_some((step_a as f64, step_b as f64))
        })
        .collect();
    let count = neighbours.len() as f64;
    let (correlation, slope) = agreement(&neighbours)?;
    let agrees = correlation > 0.5
        && (0.7..=1.3).contains(&slope)
        && correlation * count.sqrt() > 6.0
        && neighbours.len() >= 40;
    agrees.then_some((width, correlation))
}

/// Returns the correlation of pairs, and the slope of the second over the first.
fn agreement(pairs: &[(f64, f64)]) -> Option<(f64, f64)> {
    let count = pairs.len() as f64;
    let (x, y) = pairs
        .iter()
        .fold((0.0, 0.0), |sum, of| (sum.0 + of.0, sum.1 + of.1));
    let (x, y) = (x / count, y / count);
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for (a, b) in pairs {
        xx += (a - x) * (a - x);
        xy += (a - x) * (b - y);
        yy += (b - y) * (b - y);
    }
    let is_varied = xx > 0.0 && yy > 0.0;
    is_varied.then(|| (xy / (xx * yy).sqrt(), xy / xx))
}
