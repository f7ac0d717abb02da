//! The result as text: a map of two knobs, or a list of one.

use std::iter;

use ratelab_experiment::sweep::Sweep;
use ratelab_screen::{SurvivalLevel, Theme};

use super::{
    cliff::{self, AgeTable},
    columns,
    summary::{self, Figure, RowSummary, SweepSummary},
    theory::Edge,
};
use crate::summary::text::{line, paragraph};

/// The style of a map.
pub struct MapStyle {
    /// Colours and glyphs.
    pub theme: Theme,
    /// Available columns.
    pub width: usize,
}

/// An explanation of the theory, which does not predict survival.
const THEORY: &str = "of a small deviation (1/s), by linear theory: above 0 it grows, which is no\n\
                      \x20         fall yet: where the motor gives all it has, the pole may swing and stay";

/// An explanation of it where delays change at random.
const SURE: &str = "deviations shrink whatever the pattern of the delays, by the jitter margin;\n\
                    \x20         ? is no promise, and no prediction of a fall: the margin is sufficient only";

/// An explanation of the figure for chunks.
const STANDS: &str = "the share of starts that stand for ten seconds, by linear theory";

/// Returns the map: a list if one knob is swept, otherwise a line for each combination of the
/// slower knobs.
pub fn text(summary: &SweepSummary, style: &MapStyle) -> String {
    let mut lines = head_lines(summary, &style.theme);
    lines.push(String::new());
    let mut groups = summary.groups();
    match (groups.len(), groups.next()) {
        (1, Some(rows)) => {
            lines.extend(list(summary, rows, &style.theme));
            lines.push(String::new());
            if summary.runs == summary.cells {
                lines.extend(cliff::lines(summary, rows));
            }
            if rows.iter().any(|row| row.push_age_s.is_some()) {
                lines.push(line(
                    "push age",
                    "in the last second of a run, mean over the runs (ms)",
                ));
            }
            lines.extend(quadratic_cost(summary));
        }
        _ => {
            lines.extend(heat_lines(summary, style));
            for figure in summary::theory_figures(summary) {
                lines.push(String::new());
                lines.extend(theory(summary, style, &figure));
            }
            lines.push(String::new());
            lines.push(line("cells", &key(summary, &style.theme)));
        }
    }
    if summary.theory {
        lines.extend(theory_lines(summary, &style.theme));
    }
    while lines.last().is_some_and(String::is_empty) {
        lines.pop();
    }
    lines.join("\n")
}

/// Returns what is said of the theory, and of the edges that it draws.
fn theory_lines(summary: &SweepSummary, theme: &Theme) -> Vec<String> {
    let mut lines = vec![paragraph("growth", THEORY)];
    if summary.rows().iter().any(|row| row.theory.sure.is_some()) {
        lines.push(paragraph("sure", SURE));
    }
    if summary.rows().iter().any(|row| row.theory.stands.is_some()) {
        lines.push(line("stands", STANDS));
    }
    let edges = summary.edges();
    let drawn = Edge::ALL.into_iter().filter(|edge| edges.contains(edge));
    let single = summary.groups().len() == 1;
    lines.extend(drawn.map(|edge| {
        let [flat, upright] = edge_marks(edge, theme);
        let mark = if single {
            flat.repeat(2)
        } else {
            format!("{flat}{flat} {upright}")
        };
        paragraph(&mark, edge.text())
    }));
    lines
}

/// Returns what the figures under `cost` are.
fn quadratic_cost(summary: &SweepSummary) -> Option<String> {
    let cost = summary.sweep.system.judge().quadratic_cost()?;
    let text = format!("cost: mean of {}, {} runs only", cost.sum, summary.good);
    Some(line("quadratic", &text))
}

/// Returns the runs of all rows by age.
pub fn by_age(summary: &SweepSummary, table: &AgeTable, style: &MapStyle) -> String {
    let mut lines = head_lines(summary, &style.theme);
    lines.push(String::new());
    lines.extend(table.lines(&style.theme));
    lines.join("\n")
}

fn head_lines(summary: &SweepSummary, theme: &Theme) -> Vec<String> {
    head(summary, theme)
        .into_iter()
        .map(|(name, text)| line(name, &text))
        .collect()
}

/// Returns the axes of the sweep, and its progress, each with a name.
pub fn head(summary: &SweepSummary, theme: &Theme) -> Vec<(&'static str, String)> {
    let sweep = &summary.sweep;
    let runs = format!(
        "{} of {} s: {}",
        summary.cells,
        sweep.base.end.as_secs_f64(),
        factors(sweep).join(theme.glyph(" × ", " x "))
    );
    let mut lines = vec![("runs", runs)];
    let fixed = fixed(sweep);
    if !fixed.is_empty() {
        lines.insert(0, ("graph", fixed));
    }
    if summary.runs < summary.cells {
        let done = format!("only {} of these runs finished", summary.runs);
        lines.push(("stopped", done));
    }
    lines
}

/// Returns the knobs with one value.
fn fixed(sweep: &Sweep) -> String {
    let Some(cell) = sweep.cell(0) else {
        return String::new();
    };
    let fixed = columns::knob_columns(sweep)
        .into_iter()
        .filter(|column| !column.is_swept_by_another(sweep))
        .filter(|column| {
            sweep
                .axis(&column.name)
                .is_none_or(|axis| axis.values.len() == 1 && sweep.axes.last() != Some(axis))
        });
    let parts = fixed.map(|column| {
        let value = column.with_unit(&column.short(sweep, &cell));
        format!("{} {value}", column.label())
    });
    parts.collect::<Vec<_>>().join(" | ")
}

/// Returns the knobs with several values, and always the seeds and the fastest knob.
fn factors(sweep: &Sweep) -> Vec<String> {
    let count = |count: usize, what: &str| {
        let stem = what.strip_suffix('y');
        let plural = match stem.filter(|stem| !stem.ends_with(['a', 'e', 'o', 'u'])) {
            _ if count == 1 => what.to_owned(),
            Some(stem) => format!("{stem}ies"),
            None if what.ends_with('s') => format!("{what}es"),
            None => format!("{what}s"),
        };
        format!("{count} {plural}")
    };
    let main = sweep.axes.last();
    let several = columns::knob_columns(sweep)
        .into_iter()
        .filter_map(|column| {
            let axis = sweep.axis(&column.name)?;
            let counts = axis.values.len() > 1 || main == Some(axis);
            counts.then(|| count(axis.values.len(), &column.noun()))
        });
    several.chain([count(sweep.seeds.len(), "seed")]).collect()
}

/// Returns the survival level of a row.
fn level(row: &RowSummary) -> SurvivalLevel {
    SurvivalLevel::new(row.survival.held, row.survival.runs)
}

/// Returns what an edge that theory draws is made of: between two lines, and between two cells of a
/// line.
fn edge_marks(edge: Edge, theme: &Theme) -> [&'static str; 2] {
    match edge {
        Edge::Grows => [theme.glyph("┄", "-"), theme.glyph("┊", "|")],
        Edge::Sure => [theme.glyph("┈", "."), theme.glyph("┆", ":")],
        Edge::Stands => [theme.glyph("━", "="), theme.glyph("┃", "!")],
    }
}

/// Width of a bar (columns).
const BAR: usize = 14;

/// Width of a bar beside more figures (columns).
const SHORT_BAR: usize = 6;

/// Returns the rows of one group.
fn list(summary: &SweepSummary, rows: &[RowSummary], theme: &Theme) -> Vec<String> {
    let (heading, good) = (summary.main.heading(), &summary.good);
    let wide = rows
        .iter()
        .map(|row| row.value.chars().count())
        .max()
        .unwrap_or(0)
        .max(heading.chars().count());
    let counts = rows
        .iter()
        .map(|row| row.survival_text().len())
        .max()
        .unwrap_or(0)
        .max(good.len());
    let bar_width = if summary.theory { SHORT_BAR } else { BAR };
    let figures = summary::figures(summary);
    let line = |value: &str, count: &str, bar: &str, cells: &dyn Fn(&summary::Figure) -> String| {
        let cells: String = figures
            .iter()
            .map(|figure| (cells(figure), figure.width()))
            .map(|(cell, width)| format!("  {cell:>width$}"))
            .collect();
        format!("{value:>wide$}  {count:>counts$}  {bar}{cells}")
    };
    let bar = " ".repeat(bar_width);
    let mut lines = vec![line(&heading, good, &bar, &|figure| figure.name.to_owned())];
    for (place, row) in rows.iter().enumerate() {
        let bar = SurvivalLevel::bar(row.survival.held, row.survival.runs, bar_width, theme);
        let cells = |figure: &summary::Figure| figure.text(row);
        lines.push(line(&row.value, &row.survival_text(), &bar, &cells));
        let next = rows.get(place + 1);
        if let Some(edge) = next.and_then(|next| row.edge(next)) {
            let width = wide + 2 + counts + 2 + bar_width;
            let [flat, _] = edge_marks(edge, theme);
            lines.push(flat.repeat(width));
        }
    }
    lines
}

/// Columns of a cell: a glyph and a digit.
const CELL: usize = 2;

/// Blanks between the name of a group and its cells.
const GAP: usize = 2;

/// Returns the legend of the cells.
pub fn key(summary: &SweepSummary, theme: &Theme) -> String {
    let key = SurvivalLevel::key(&summary.good, theme);
    format!("{key}; the digit is the share in tenths")
}

/// Returns the map, in several pieces if it is too wide for one.
fn heat_lines(summary: &SweepSummary, style: &MapStyle) -> Vec<String> {
    let theme = &style.theme;
    let cell = |row: &RowSummary| level(row).paint(&cell(row, theme), theme);
    if !summary.theory {
        return pieces(summary, style, CELL, |rows, place| cell(&rows[place]));
    }
    // A column more, for the edges, and a line where there are some between groups.
    pieces(summary, style, CELL + 1, |rows, place| {
        let next = rows.get(place + 1);
        let edge = next.and_then(|next| rows[place].edge(next));
        let [_, upright] = edge.map_or([" "; 2], |edge| edge_marks(edge, theme));
        cell(&rows[place]) + upright
    })
}

/// Returns a figure of linear theory for each cell, beside the map.
pub fn theory(summary: &SweepSummary, style: &MapStyle, figure: &Figure) -> Vec<String> {
    let widest = summary
        .rows()
        .iter()
        .map(|row| figure.text(row))
        .map(|text| text.len())
        .max()
        .unwrap_or(1);
    pieces(summary, style, widest + 1, |rows, place| {
        format!("{:>widest$} ", figure.text(&rows[place]))
    })
}

/// Returns a glyph, followed by tenths if some but not all runs were successful.
fn cell(row: &RowSummary, theme: &Theme) -> String {
    let level = level(row);
    let glyph = level.glyph(theme);
    match (level, row.survival.share()) {
        (SurvivalLevel::Unknown | SurvivalLevel::None | SurvivalLevel::All, _) | (_, None) => {
            glyph.repeat(CELL)
        }
        (_, Some(share)) => format!("{glyph}{}", (share * 10.0) as u64),
    }
}

fn pieces(
    summary: &SweepSummary,
    style: &MapStyle,
    cell: usize,
    text: impl Fn(&[RowSummary], usize) -> String,
) -> Vec<String> {
    let grid = summary.grid();
    let wide = grid.wide();
    let line = |name: &str, cells: &str| {
        let line = format!("{name:<wide$}{:GAP$}{cells}", "");
        line.trim_end().to_owned()
    };
    let fit = (style.width.saturating_sub(wide + GAP) / cell).max(1);
    let count = grid.values.len();
    let mut lines = Vec::new();
    for first in (0..count).step_by(fit) {
        let piece = first..count.min(first + fit);
        if first > 0 {
            lines.push(String::new());
        }
        let axis = [&*grid.heading]
            .into_iter()
            .chain(iter::repeat(""))
            .zip(axis(&grid.values[piece.clone()], cell));
        lines.extend(axis.map(|(name, cells)| line(name, &cells)));
        for (place, (name, rows)) in grid.groups.iter().enumerate() {
            let cells: String = piece.clone().map(|place| text(rows, place)).collect();
            lines.push(line(name, &cells));
            let next = grid.groups.get(place + 1).filter(|_| summary.is_plane());
            let edges = next
                .map(|(_, next)| {
                    let (rows, next) = (&rows[piece.clone()], &next[piece.clone()]);
                    edges(rows, next, cell, &style.theme)
                })
                .filter(|edges| !edges.trim().is_empty());
            lines.extend(edges.map(|edges| line("", &edges)));
        }
    }
    lines
}

/// Returns the edges that theory draws between two groups, each as wide as a cell.
fn edges(rows: &[RowSummary], next: &[RowSummary], cell: usize, theme: &Theme) -> String {
    let marks = rows.iter().zip(next).map(|(row, next)| {
        let edge = row.edge(next);
        let [flat, _] = edge.map_or([" "; 2], |edge| edge_marks(edge, theme));
        flat.repeat(cell - 1) + " "
    });
    marks.collect()
}

/// Returns the values above their cells, written vertically if they are too long.
fn axis(labels: &[&str], cell: usize) -> Vec<String> {
    let labels = aligned(labels);
    let longest = labels.iter().map(String::len).max().unwrap_or(0);
    if longest < cell {
        let cells = labels
            .iter()
            .map(|label| format!("{:<cell$}", label.trim()));
        return vec![cells.collect()];
    }
    let line = |number: usize| {
        labels
            .iter()
            .map(|label| label.chars().nth(number).unwrap_or(' '))
            .map(|letter| format!("{letter:<cell$}"))
            .collect()
    };
    (0..longest).map(line).collect()
}

/// Returns `labels`, aligned at their decimal points.
fn aligned(labels: &[&str]) -> Vec<String> {
    let whole = |label: &str| label.find('.').unwrap_or(label.len());
    let most = labels.iter().map(|label| whole(label)).max().unwrap_or(0);
    let pad = |label: &&str| " ".repeat(most - whole(label)) + label;
    labels.iter().map(pad).collect()
}
