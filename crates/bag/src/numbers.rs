//! Quantiles and medians of times.

/// One millisecond (ns).
pub const MS: i64 = 1_000_000;

/// One second (ns).
pub const S: i64 = 1_000 * MS;

/// Returns the nearest whole number, half away from zero.
pub fn nearest(value: f64) -> i64 {
    value.round() as i64
}

/// Returns the place (from 0) of the quantile of `count` sorted values by nearest rank, in
/// thousandths.
fn place(count: usize, permille: usize) -> usize {
    (count * permille).div_ceil(1_000).max(1) - 1
}

/// Returns the quantile of sorted `values` by nearest rank, in thousandths; 0 of none.
pub fn quantile_of_sorted(values: &[i64], permille: usize) -> i64 {
    let place = place(values.len(), permille);
    values.get(place).copied().unwrap_or(0)
}

/// Returns the quantile of `values` by nearest rank, in thousandths, which changes their order; 0
/// of none.
pub fn quantile(values: &mut [i64], permille: usize) -> i64 {
    if values.is_empty() {
        return 0;
    }
    let place = place(values.len(), permille);
    *values.select_nth_unstable(place).1
}

/// Returns what lies between the quantiles 0.1 and 0.9 of `values`, whose order changes.
pub fn spread(values: &mut [i64]) -> i64 {
    quantile(values, 900).saturating_sub(quantile(values, 100))
}

/// Returns the width of the shortest interval with half of `values`, which are sorted by it.
pub fn shortest_half(values: &mut [i64]) -> i64 {
    values.sort_unstable();
    let half = values.len() / 2;
    let widths = values.iter().zip(values.iter().skip(half));
    widths.map(|(low, high)| high - low).min().unwrap_or(0)
}

/// Returns the median for rules: the mean of the middle two.
pub fn median(mut values: Vec<i64>) -> f64 {
    let count = values.len();
    if count == 0 {
        return 0.0;
    }
    let (below, middle, _) = values.select_nth_unstable(count / 2);
    let middle = *middle;
    if count % 2 == 1 {
        return middle as f64;
    }
    let other = below.iter().copied().max().unwrap_or(middle);
    (middle as f64 + other as f64) / 2.0
}

/// Returns the median of doubles: the mean of the middle two; 0 of none.
pub fn median_f64(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => 0.0,
        n if n % 2 == 1 => values[n / 2],
        n => f64::midpoint(values[n / 2 - 1], values[n / 2]),
    }
}

/// Returns the differences of neighbours.
pub fn steps(times: &[i64]) -> Vec<i64> {
    times.windows(2).map(|pair| pair[1] - pair[0]).collect()
}
