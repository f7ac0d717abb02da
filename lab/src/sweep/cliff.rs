//! The position of the cliff, as text.

use ratelab::KnobKind;

use super::summary::{RowSummary, SweepSummary};
use crate::summary::text::line;

/// Returns the lines for the rows of one group.
pub fn lines(summary: &SweepSummary, rows: &[RowSummary]) -> Vec<String> {
    let mut rows: Vec<&RowSummary> = rows.iter().filter(|row| row.survival.runs > 0).collect();
    if rows.len() < 2 || rows.iter().any(|row| row.number().is_nan()) {
        return Vec::new();
    }
    rows.sort_by(|a, b| a.number().total_cmp(&b.number()));
    let helps = rows[0].survival.share() <= rows[rows.len() - 1].survival.share();
    if !helps {
        rows.reverse();
    }
    let cliff = CliffWords { summary, helps };
    let mut lines = vec![line("cliff", &cliff.edges(&rows))];
    lines.extend(cliff.dip(&rows).map(|text| line("uneven", &text)));
    lines
}

/// The words for a quantity with an order.
struct CliffWords<'s> {
    summary: &'s SweepSummary,
    /// Whether more of it is better.
    helps: bool,
}

impl CliffWords<'_> {
    /// Returns what its values are called, and what is better.
    fn words(&self) -> (&'static str, &'static str) {
        match (self.summary.main.kind, self.helps) {
            (KnobKind::Rate, true) => ("rate", "faster"),
            (KnobKind::Rate, false) => ("rate", "slower"),
            (KnobKind::Depth, true) => ("depth", "deeper"),
            (KnobKind::Depth, false) => ("depth", "shallower"),
            (_, true) => ("value", "more"),
            (_, false) => ("value", "less"),
        }
    }

    fn at(&self, row: &RowSummary) -> String {
        self.summary.main.with_unit(&row.value)
    }

    /// Returns the values of the better or the worse end, as far as `row`.
    fn end(&self, better: bool, row: &RowSummary) -> String {
        if better == self.helps {
            format!("from {} on", self.at(row))
        } else {
            format!("up to {}", self.at(row))
        }
    }

    /// Returns the last value without successful runs, and the first from which on all are
    /// successful.
    fn edges(&self, rows: &[&RowSummary]) -> String {
        let (good, (noun, _)) = (&self.summary.good, self.words());
        let down = rows.iter().take_while(|row| row.survival.held == 0).count();
        let up = rows
            .iter()
            .rev()
            .take_while(|row| row.survival.held == row.survival.runs)
            .count();
        let last_down = down.checked_sub(1).map(|last| self.end(false, rows[last]));
        let first_up = (up > 0).then(|| self.end(true, rows[rows.len() - up]));
        let (higher, lowest, highest) = if self.helps {
            ("higher", "lowest", "highest")
        } else {
            ("lower", "highest", "lowest")
        };
        match (last_down, first_up) {
            _ if down == rows.len() => format!("none {good} at any of these {noun}s"),
            _ if up == rows.len() => format!("all {good} at each of these {noun}s"),
            (Some(down), Some(up)) => format!("none {good} {down}, all {up}"),
            (Some(down), None) => {
                format!("none {good} {down}, not all at any {higher} {noun} to the end")
            }
            (None, Some(up)) => format!("all {good} {up}"),
            (None, None) => format!("some {good} at the {lowest} {noun}, not all at the {highest}"),
        }
    }

    /// Returns the value at which most is lost by going to the next better one.
    fn dip(&self, rows: &[&RowSummary]) -> Option<String> {
        let drops = rows.windows(2).filter_map(|pair| {
            let drop = pair[0].survival.share()? - pair[1].survival.share()?;
            (drop > 0.0).then_some((drop, pair))
        });
        let (_, pair) = drops.max_by(|(a, _), (b, _)| a.total_cmp(b))?;
        let [less, more] =
            [pair[0], pair[1]].map(|row| format!("{} at {}", row.survival_text(), self.at(row)));
        let (_, better) = self.words();
        Some(format!("{less}, then {more}: {better}, yet worse"))
    }
}
