//! The age of data over time, and at each publication.

use crate::numbers::quantile;

/// Ages of a chain (ns).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ages {
    /// The mean over time.
    pub mean: f64,
    /// The least age that is not exceeded for 99 % of the time.
    pub p99: i64,
    /// The mean at publication.
    pub mean_published: f64,
    /// The 99th percentile at publication.
    pub p99_published: i64,
    /// The least at publication.
    pub min_published: i64,
}

impl Ages {
    /// Creates the ages of data that began at the second and was published at the first time of
    /// each of
    /// `events`, until `end`.
    pub fn new(events: &[(i64, i64)], end: i64) -> Option<Self> {
        let mut ages: Vec<i64> = events.iter().map(|(e, s)| e.saturating_sub(*s)).collect();
        let sum: i128 = ages.iter().map(|age| i128::from(*age)).sum();
        let (mean, p99) = over_time(events, end)?;
        Some(Self {
            mean,
            p99,
            mean_published: sum as f64 / ages.len() as f64,
            min_published: ages.iter().copied().min()?,
            p99_published: quantile(&mut ages, 990),
        })
    }
}

/// Returns the mean age over time until `end`, and what it does not exceed for 99 % of that.
pub fn over_time(events: &[(i64, i64)], end: i64) -> Option<(f64, i64)> {
    let mut newest = i64::MIN;
    // Age at the beginning of each time, and its length.
    let mut teeth: Vec<(i64, i64)> = Vec::with_capacity(events.len());
    for (place, (event, stamp)) in events.iter().enumerate() {
        newest = newest.max(*stamp);
        let next = events.get(place + 1).map_or(end, |(next, _)| *next);
        teeth.push((event.saturating_sub(newest), (next - event).max(0)));
    }
    let length: i128 = teeth.iter().map(|(_, length)| i128::from(*length)).sum();
    if length == 0 {
        return None;
    }
    let twice = |(age, length): &(i64, i64)| {
        (2 * i128::from(*age) + i128::from(*length)) * i128::from(*length)
    };
    let mean = teeth.iter().map(twice).sum::<i128>() as f64 / 2.0 / length as f64;
    let within = |most: i64| {
        let time = teeth.iter().map(|(age, length)| {
            let within = i128::from(most) - i128::from(*age);
            within.clamp(0, i128::from(*length))
        });
        time.sum::<i128>() * 100 >= length * 99
    };
    let mut low = teeth.iter().map(|(age, _)| *age).min()?;
    let mut high = teeth
        .iter()
        .map(|(age, length)| age.saturating_add(*length))
        .max()?;
    while low < high {
        let middle = low + (high.saturating_sub(low)) / 2;
        if within(middle) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    Some((mean, low))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_age_over_time_is_that_of_a_saw_counted_by_hand() {
        const MS: i64 = 1_000_000;
        let events = [(0, -10), (100, 90), (300, 250)].map(|(e, s)| (e * MS, s * MS));
        let (mean, p99) = over_time(&events, 400 * MS).expect("an age");
        assert_eq!((mean, p99), (95.0 * MS as f64, 206 * MS));
    }
}
