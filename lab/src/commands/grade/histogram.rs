//! The predictions of a class for one question, counted.

use exercises::framework::Brief;
use serde::Serialize;

/// Rows of numbers at most; more different ones are counted in ranges.
const ROWS: usize = 9;

/// Columns of the longest bar.
const BAR: usize = 40;

/// A row: what was predicted, by how many, and how many of them are right.
#[derive(Debug, PartialEq, Eq, Serialize)]
pub struct Tally {
    /// The number or choice, or a range of numbers.
    #[serde(rename = "predicted")]
    pub what: String,
    /// How many predicted it.
    pub count: usize,
    /// How many of these are right.
    pub right: usize,
}

/// Counts `predictions`, each a number and whether it is right, in ascending order.
pub fn rows(brief: &Brief, predictions: &[(f64, bool)]) -> Vec<Tally> {
    let mut sorted = predictions.to_vec();
    sorted.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let same = sorted.chunk_by(|(a, _), (b, _)| a == b);
    if !brief.choices.is_empty() || same.clone().count() <= ROWS {
        return same.map(|of| row(brief.in_unit(of[0].0), of)).collect();
    }
    let span = sorted[sorted.len() - 1].0 - sorted[0].0;
    let width = round_step(span / (ROWS - 1) as f64);
    let range = |number: f64| (number / width).floor();
    let ranges = sorted.chunk_by(|(a, _), (b, _)| range(*a) == range(*b));
    ranges
        .map(|of| {
            let from = range(of[0].0);
            let [from, to] = [from, from + 1.0].map(|n| (n * width * 1e6).round() / 1e6);
            row(format!("{from} to below {}", brief.in_unit(to)), of)
        })
        .collect()
}

fn row(what: String, of: &[(f64, bool)]) -> Tally {
    Tally {
        what,
        count: of.len(),
        right: of.iter().filter(|(_, right)| *right).count(),
    }
}

/// Returns the next of 1, 2, 5, 10 and so on that is not below `least`.
fn round_step(least: f64) -> f64 {
    let power = 10_f64.powf(least.log10().floor());
    let steps = [1.0, 2.0, 5.0].map(|step| step * power);
    steps
        .into_iter()
        .find(|step| *step >= least)
        .unwrap_or(10.0 * power)
}

/// Returns a line for each row, with a bar.
pub fn lines(rows: &[Tally]) -> Vec<String> {
    let wide = rows
        .iter()
        .map(|row| row.what.chars().count())
        .max()
        .unwrap_or(0);
    let most = rows.iter().map(|row| row.count).max().unwrap_or(0).max(BAR);
    let line = |row: &Tally| {
        let bar = "█".repeat((row.count * BAR).div_ceil(most));
        let right = match row.right {
            0 => String::new(),
            right if right == row.count => " ✓".to_owned(),
            right => format!(" ✓ {right}"),
        };
        format!("  {:>wide$}  {bar} {}{right}", row.what, row.count)
    };
    rows.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn brief(label: &str) -> &'static Brief {
        exercises::named(label)[0].brief()
    }

    #[test]
    fn a_few_numbers_are_counted_each_and_many_in_ranges() {
        let few = [(8.0, true), (20.0, false), (8.0, true)];
        let few = rows(brief("1"), &few);
        assert_eq!(lines(&few), ["   8 Hz  ██ 2 ✓", "  20 Hz  █ 1"]);
        let many: Vec<_> = (0..30).map(|n| (f64::from(n) / 2.0, n == 15)).collect();
        let many = rows(brief("1"), &many);
        assert!(many.len() <= ROWS, "{many:?}");
        assert_eq!(many.iter().map(|row| row.count).sum::<usize>(), 30);
        assert_eq!(lines(&many)[3], "    6 to below 8 Hz  ████ 4 ✓ 1");
    }

    #[test]
    fn choices_are_counted_by_their_names_and_long_bars_are_scaled() {
        let chosen: Vec<_> = (0..400)
            .map(|n| (f64::from(1 + n % 2), n % 2 == 0))
            .collect();
        let rows = rows(brief("10"), &chosen);
        assert_eq!(rows.len(), 2);
        assert_eq!(rows[0].what, brief("10").choices[0]);
        let lines = lines(&rows);
        let fit = lines.iter().all(|line| line.chars().count() <= 80);
        assert!(fit, "{lines:?}");
    }
}
