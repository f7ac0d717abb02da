//! The sweep as a table in Markdown.

use ratelab::millis;
use ratelab_screen::Theme;

use super::{
    figures, map,
    parts::PartColumn,
    summary::{RowSummary, SweepSummary},
};

/// Returns the runs in a line, and a table: a row per value with its figures if one knob is swept,
/// otherwise a row per combination of the slower knobs and a column per value of the fastest.
pub fn text(summary: &SweepSummary, theme: &Theme) -> String {
    let mut groups = summary.groups();
    let mut table = match (groups.len(), groups.next()) {
        (1, Some(rows)) => figures(summary, rows),
        _ => counts(summary),
    };
    let head = map::head(summary, theme).into_iter();
    let head: Vec<String> = head.map(|(name, text)| format!("{name}: {text}")).collect();
    // The line below the heading: figures are aligned to the right.
    table.insert(1, vec!["---:".to_owned(); table[0].len()]);
    let table: Vec<String> = table.iter().map(|cells| row(cells)).collect();
    format!("{}\n\n{}", head.join("; "), table.join("\n"))
}

/// Returns the rows of one group with their figures, below a heading.
fn figures(summary: &SweepSummary, rows: &[RowSummary]) -> Vec<Vec<String>> {
    let figures = figures::all(summary);
    let mut head = vec![summary.main.heading(), summary.good.clone()];
    head.extend(figures.iter().map(|of| format!("{}{}", of.name, of.unit)));
    head.extend(summary.parts.iter().map(PartColumn::name));
    let body = rows.iter().map(|row| {
        let mut cells = vec![row.value.clone(), figures::count(row)];
        cells.extend(figures.iter().map(|figure| figure.text(row)));
        let ms = |ms: &Option<f64>| ms.map_or("-".to_owned(), millis::text);
        cells.extend(row.parts.iter().map(ms));
        cells
    });
    [head].into_iter().chain(body).collect()
}

/// Returns how many runs were successful, below the values of the fastest knob.
fn counts(summary: &SweepSummary) -> Vec<Vec<String>> {
    let grid = summary.grid();
    let values = grid.values.into_iter().map(str::to_owned);
    let head: Vec<String> = [grid.heading].into_iter().chain(values).collect();
    let rows = grid.groups.into_iter().map(|(name, rows)| {
        let counts = rows.iter().map(figures::count);
        [name].into_iter().chain(counts).collect()
    });
    [head].into_iter().chain(rows).collect()
}

fn row(cells: &[String]) -> String {
    let cells: Vec<String> = cells.iter().map(|cell| cell.replace('|', "\\|")).collect();
    format!("| {} |", cells.join(" | "))
}
