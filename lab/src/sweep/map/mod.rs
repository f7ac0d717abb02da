//! The result as text: a map of two knobs, or a list of one.

mod heat;

use ratelab_experiment::sweep::Sweep;
use ratelab_screen::{SurvivalLevel, Theme};

use super::{
    by_age::AgeTable,
    cliff, columns,
    summary::{self, RowSummary, SweepSummary},
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
            lines.extend(heat::lines(summary, style));
            for figure in summary::theory_figures(summary) {
                lines.push(String::new());
                lines.extend(heat::theory(summary, style, &figure));
            }
            lines.push(String::new());
            lines.push(line("cells", &heat::key(summary, &style.theme)));
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
