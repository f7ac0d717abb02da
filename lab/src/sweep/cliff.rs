//! The position of the cliff, as text.

use ratelab::runtime::KnobKind;

use super::summary::{RowSummary, SweepSummary};
use crate::report::line;

/// The lines for the rows of one group.
pub fn lines(summary: &SweepSummary, rows: &[RowSummary]) -> Vec<String> {
    let cliff = match summary.main.kind {
        KnobKind::Rate => Cliff::new(summary, "rate", "faster"),
        KnobKind::Depth => Cliff::new(summary, "depth", "deeper"),
        _ => return Vec::new(),
    };
    let mut rows: Vec<&RowSummary> = rows.iter().filter(|row| row.runs > 0).collect();
    rows.sort_by(|a, b| a.number().total_cmp(&b.number()));
    if rows.len() < 2 {
        return Vec::new();
    }
    let mut lines = vec![line("cliff", &cliff.edges(&rows))];
    lines.extend(cliff.dip(&rows).map(|text| line("uneven", &text)));
    lines
}

/// The words for a quantity with an order.
struct Cliff<'s> {
    summary: &'s SweepSummary,
    noun: &'static str,
    more: &'static str,
}

impl<'s> Cliff<'s> {
    fn new(summary: &'s SweepSummary, noun: &'static str, more: &'static str) -> Self {
        Self {
            summary,
            noun,
            more,
        }
    }

    fn at(&self, row: &RowSummary) -> String {
        self.summary.main.with_unit(&row.value)
    }

    /// The last value without successful runs, and the first from which on all are
    /// successful.
    fn edges(&self, rows: &[&RowSummary]) -> String {
        let (good, noun) = (&self.summary.good, self.noun);
        let down = rows.iter().take_while(|row| row.held == 0).count();
        let up = rows
            .iter()
            .rev()
            .take_while(|row| row.held == row.runs)
            .count();
        let last_down = down.checked_sub(1).map(|last| self.at(rows[last]));
        let first_up = (up > 0).then(|| self.at(rows[rows.len() - up]));
        match (last_down, first_up) {
            _ if down == rows.len() => format!("none {good} at any of these {noun}s"),
            _ if up == rows.len() => format!("all {good} at each of these {noun}s"),
            (Some(down), Some(up)) => format!("none {good} up to {down}, all from {up} on"),
            (Some(down), None) => {
                format!("none {good} up to {down}, not all at any higher {noun} to the end")
            }
            (None, Some(up)) => format!("all {good} from {up} on"),
            (None, None) => format!("some {good} at the lowest {noun}, not all at the highest"),
        }
    }

    /// The step to a higher value with the largest loss of survival.
    fn dip(&self, rows: &[&RowSummary]) -> Option<String> {
        let drops = rows.windows(2).filter_map(|pair| {
            let drop = pair[0].share()? - pair[1].share()?;
            (drop > 0.0).then_some((drop, pair))
        });
        let (_, pair) = drops.max_by(|(a, _), (b, _)| a.total_cmp(b))?;
        let [less, more] = [pair[0], pair[1]]
            .map(|row| format!("{} of {} at {}", row.held, row.runs, self.at(row)));
        Some(format!("{less}, then {more}: {}, yet worse", self.more))
    }
}
