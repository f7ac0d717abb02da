//! A line per value, with a bar and figures.

use ratelab_screen::{SurvivalLevel, Theme};

use super::edge_marks;
use crate::sweep::{
    figures,
    summary::{RowSummary, SweepSummary},
};

/// Width of a bar (columns).
const BAR: usize = 14;

/// Width of a bar beside more figures (columns).
const SHORT_BAR: usize = 6;

/// Returns the rows of one group.
pub fn lines(summary: &SweepSummary, rows: &[RowSummary], theme: &Theme) -> Vec<String> {
    let (heading, good) = (summary.main.heading(), &summary.good);
    let values = rows.iter().map(|row| row.value.chars().count());
    let wide = values.max().unwrap_or(0).max(heading.chars().count());
    let counts = rows
        .iter()
        .map(|row| figures::count(row).len())
        .max()
        .unwrap_or(0)
        .max(good.len());
    let bar_width = if summary.theory { SHORT_BAR } else { BAR };
    let figures = figures::all(summary);
    let line = |value: &str, count: &str, bar: &str, cells: &dyn Fn(&figures::Figure) -> String| {
        let cells = figures
            .iter()
            .map(|figure| (cells(figure), figure.width()))
            .map(|(cell, width)| format!("  {cell:>width$}"));
        let cells: String = cells.collect();
        format!("{value:>wide$}  {count:>counts$}  {bar}{cells}")
    };
    let bar = " ".repeat(bar_width);
    let mut lines = vec![line(&heading, good, &bar, &|figure| figure.name.to_owned())];
    for (place, row) in rows.iter().enumerate() {
        let bar = SurvivalLevel::bar(row.survival.held, row.survival.runs, bar_width, theme);
        let cells = |figure: &figures::Figure| figure.text(row);
        lines.push(line(&row.value, &figures::count(row), &bar, &cells));
        let next = rows.get(place + 1);
        if let Some(edge) = next.and_then(|next| row.edge(next)) {
            let width = wide + 2 + counts + 2 + bar_width;
            let [flat, _] = edge_marks(edge, theme);
            lines.push(flat.repeat(width));
        }
    }
    lines
}
