//! A line per value, with a bar and figures.

use super::{growth_text, level, paint};
use crate::{
    dashboard::view::theme::Theme,
    sweep::summary::{RowSummary, SweepSummary},
};

/// Width of a bar (columns).
const BAR: usize = 24;

/// The rows of one group.
pub fn lines(
    summary: &SweepSummary,
    rows: &[RowSummary],
    theory: bool,
    theme: &Theme,
) -> Vec<String> {
    let (heading, good) = (summary.main.heading(), &summary.good);
    let values = rows.iter().map(|row| row.value.chars().count());
    let wide = values.max().unwrap_or(0).max(heading.chars().count());
    let most = rows.iter().map(|row| figure(row).len()).max().unwrap_or(0);
    let counts = most.max(good.len());
    let mut head = format!(
        "{heading:>wide$}  {good:>counts$}  {:BAR$}  {:>10}  {:>9}",
        "", "latency ms", "lost at s"
    );
    if theory {
        head += "  growth";
    }
    let mut lines = vec![head];
    for row in rows {
        let mut line = format!(
            "{:>wide$}  {:>counts$}  {}  {:>10}  {:>9}",
            row.value,
            figure(row),
            bar(row, theme),
            decimals(row.mean_latency_s.map(|s| s * 1e3), 1),
            decimals(row.lost_at_s, 2),
        );
        if theory {
            line += &format!("  {:>6}", growth_text(row.growth));
        }
        lines.push(line);
    }
    lines
}

fn figure(row: &RowSummary) -> String {
    match row.runs {
        0 => "-".to_owned(),
        runs => format!("{} of {runs}", row.held),
    }
}

/// A bar in proportion to the share; empty only for none, and full only for all.
fn bar(row: &RowSummary, theme: &Theme) -> String {
    let share = row.share().unwrap_or(0.0);
    let full = match row.held {
        0 => 0,
        all if all == row.runs => BAR,
        _ => ((share * BAR as f64).round() as usize).clamp(1, BAR - 1),
    };
    let level = level(row);
    let rest = if row.runs == 0 {
        " "
    } else {
        theme.glyph("·", ".")
    };
    let text = level.glyph(theme).repeat(full) + &rest.repeat(BAR - full);
    paint(&text, level, theme)
}

fn decimals(value: Option<f64>, places: usize) -> String {
    value.map_or("-".to_owned(), |value| format!("{value:.places$}"))
}
