//! A line per value, with a bar and figures.

use super::{cost_text, decimals, edge_mark, figure, growth_text};
use crate::{
    sweep::{
        summary::{RowSummary, SweepSummary},
        survival_level::SurvivalLevel,
    },
    theme::Theme,
};

/// Width of a bar (columns).
const BAR: usize = 14;

/// The same beside more figures.
const SHORT_BAR: usize = 6;

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
    let cost = summary.sweep.system.quadratic_cost().is_some();
    let bar_width = if theory { SHORT_BAR } else { BAR };
    let mut head = format!(
        "{heading:>wide$}  {good:>counts$}  {:bar_width$}  {:>10}  {:>8}  {:>9}",
        "", "latency ms", "push age", "lost at s"
    );
    if cost {
        head += "    cost";
    }
    if theory {
        head += "  growth";
    }
    let mut lines = vec![head];
    for (place, row) in rows.iter().enumerate() {
        let mut line = format!(
            "{:>wide$}  {:>counts$}  {}  {:>10}  {:>8}  {:>9}",
            row.value,
            figure(row),
            SurvivalLevel::bar(row.held, row.runs, bar_width, theme),
            decimals(row.mean_latency_s.map(|s| s * 1e3), 1),
            decimals(row.push_age_s.map(|s| s * 1e3), 1),
            decimals(row.lost_at_s, 2),
        );
        if cost {
            line += &format!("  {:>6}", cost_text(row.cost));
        }
        if theory {
            line += &format!("  {:>6}", growth_text(row.theory));
        }
        lines.push(line);
        let next = rows.get(place + 1);
        if let Some(edge) = next.and_then(|next| row.edge(next)) {
            let width = wide + 2 + counts + 2 + bar_width;
            lines.push(edge_mark(edge, theme).repeat(width));
        }
    }
    lines
}
