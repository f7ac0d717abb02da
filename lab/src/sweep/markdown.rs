//! The sweep as a table in Markdown.

use super::{
    map,
    summary::{RowSummary, SweepSummary},
};
use crate::theme::Theme;

/// The runs in a line, and a table: a row per value with its figures if one knob is swept,
/// otherwise a row per combination of the slower knobs and a column per value of the
/// fastest.
pub fn text(summary: &SweepSummary, theory: bool, theme: &Theme) -> String {
    let mut groups = summary.groups();
    let table = match (groups.len(), groups.next()) {
        (1, Some(rows)) => figures(summary, rows, theory),
        _ => counts(summary),
    };
    let head = map::head(summary, theme).into_iter();
    let head: Vec<String> = head.map(|(name, text)| format!("{name}: {text}")).collect();
    let table: Vec<String> = table.iter().map(|cells| row(cells)).collect();
    format!("{}\n\n{}", head.join("; "), table.join("\n"))
}

/// The rows of one group with their figures, below a heading.
fn figures(summary: &SweepSummary, rows: &[RowSummary], theory: bool) -> Vec<Vec<String>> {
    let cost = summary.sweep.system.quadratic_cost().is_some();
    let mut head = vec![
        summary.main.heading(),
        summary.good.clone(),
        "latency ms".to_owned(),
        "push age ms".to_owned(),
        "lost at s".to_owned(),
    ];
    head.extend(cost.then(|| "cost".to_owned()));
    head.extend(theory.then(|| "growth".to_owned()));
    let line = rule(head.len());
    let rows = rows.iter().map(|row| {
        let mut cells = vec![row.value.clone(), map::figure(row)];
        cells.push(map::decimals(row.mean_latency_s.map(|s| s * 1e3), 1));
        cells.push(map::decimals(row.push_age_s.map(|s| s * 1e3), 1));
        cells.push(map::decimals(row.lost_at_s, 2));
        cells.extend(cost.then(|| map::cost_text(row.cost)));
        cells.extend(theory.then(|| map::growth_text(row.theory)));
        cells
    });
    [head, line].into_iter().chain(rows).collect()
}

/// How many runs were successful, below the values of the fastest knob.
fn counts(summary: &SweepSummary) -> Vec<Vec<String>> {
    let values = summary.groups().next().unwrap_or_default().iter();
    let values = values.map(|row| row.value.clone());
    let head: Vec<String> = [summary.main.heading()].into_iter().chain(values).collect();
    let line = rule(head.len());
    let rows = summary.groups().map(|rows| {
        let name = [summary.group_name(rows)].into_iter();
        name.chain(rows.iter().map(map::figure)).collect()
    });
    [head, line].into_iter().chain(rows).collect()
}

/// The line below the heading: figures are aligned to the right.
fn rule(columns: usize) -> Vec<String> {
    vec!["---:".to_owned(); columns]
}

fn row(cells: &[String]) -> String {
    let cells: Vec<String> = cells.iter().map(|cell| cell.replace('|', "\\|")).collect();
    format!("| {} |", cells.join(" | "))
}
