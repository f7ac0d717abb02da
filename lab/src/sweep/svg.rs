//! The result as a heat map, and as a table in Markdown.

use std::fmt::Write;

use ratelab::millis;
use ratelab_screen::{Look, Theme, escaped};

use super::{
    columns::PartColumn,
    map,
    summary::{self, RowSummary, SweepGrid, SweepSummary},
};

/// Height of a cell and of a line of text, width of a character (pixels).
const ROW: usize = 30;
const LINE: usize = 20;
const CHARACTER: usize = 8;

/// Space around the map (pixels).
const EDGE: usize = 12;

/// Successful runs, lost runs, runs that did not finish, text: the same text can be read on
/// the first three.
const GOOD: &str = "#8cc4f0";
const LOST: &str = "#f7dcae";
const OPEN: &str = "#ffffff";
const INK: &str = "#1f2328";

/// A map for papers and pages.
const THEME: Theme = Theme {
    colour: true,
    ascii: false,
    look: Look::Light,
};

/// Returns the heat map of a sweep.
pub fn svg(summary: &SweepSummary) -> String {
    let map = HeatMap::new(summary);
    let head = map::head(summary, &THEME).into_iter();
    let mut lines: Vec<String> = head.map(|(name, text)| format!("{name}: {text}")).collect();
    let most = summary.sweep.seeds.len();
    lines.push(format!("number of runs of {most} that {}", summary.good));
    let top = EDGE + lines.len() * LINE;
    let texts = lines.iter().map(|line| line.chars().count() * CHARACTER);
    let map_width = map.left + map.cell * map.grid.values.len();
    let width = map_width.max(texts.max().unwrap_or(0)) + 2 * EDGE;
    let height = top + LINE + map.grid.groups.len() * ROW + LINE + EDGE;
    let label = escaped(&lines.join("; "));
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
         width=\"{width}\" height=\"{height}\" role=\"img\" aria-label=\"{label}\" \
         font-family=\"DejaVu Sans Mono, Menlo, Consolas, monospace\" font-size=\"13\" \
         fill=\"{INK}\">\n<rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>\n"
    );
    for (number, line) in lines.iter().enumerate() {
        text(&mut svg, (EDGE, EDGE + 14 + number * LINE), "start", line);
    }
    map.draw(&mut svg, top);
    svg.push_str("</svg>\n");
    svg
}

/// The cells and their labels.
struct HeatMap<'s> {
    summary: &'s SweepSummary,
    grid: SweepGrid<'s>,
    /// Where the cells begin, and the width of one (pixels).
    left: usize,
    cell: usize,
}

impl<'s> HeatMap<'s> {
    fn new(summary: &'s SweepSummary) -> Self {
        let grid = summary.grid();
        let counts = summary
            .rows()
            .iter()
            .map(|row| row.survival.held.to_string().len());
        let labels = grid.values.iter().map(|value| value.chars().count());
        let cell = counts.chain(labels).max().unwrap_or(0).max(3) + 1;
        Self {
            left: EDGE + grid.wide() * CHARACTER + EDGE,
            cell: cell * CHARACTER,
            summary,
            grid,
        }
    }

    fn draw(&self, svg: &mut String, top: usize) {
        let above = top + 14;
        let end = self.left - EDGE;
        text(svg, (end, above), "end", &self.grid.heading);
        for (place, value) in self.grid.values.iter().enumerate() {
            text(svg, (self.middle(place), above), "middle", value);
        }
        for (number, (name, rows)) in self.grid.groups.iter().enumerate() {
            let y = top + LINE + number * ROW;
            text(svg, (end, y + 20), "end", name);
            for (place, row) in rows.iter().enumerate() {
                self.cell(svg, (place, y), name, row);
            }
        }
    }

    fn middle(&self, place: usize) -> usize {
        self.left + place * self.cell + self.cell / 2
    }

    fn cell(&self, svg: &mut String, (place, y): (usize, usize), name: &str, row: &RowSummary) {
        let (x, width) = (self.left + place * self.cell + 1, self.cell - 2);
        let height = ROW - 2;
        let fill = if row.survival.runs == 0 { OPEN } else { LOST };
        let bar = (row.survival.share().unwrap_or(0.0) * height as f64).round() as usize;
        let value = self.summary.main.with_unit(&row.value);
        let value = format!("{} {value}", self.summary.main.label());
        let place_name = [name, &value].join(" ");
        let told = format!("{}: {}", place_name.trim(), row.survival_text());
        let told = escaped(&told);
        let _ = writeln!(
            svg,
            "<g><title>{told}</title>\
             <rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" fill=\"{fill}\"/>\
             <rect x=\"{x}\" y=\"{}\" width=\"{width}\" height=\"{bar}\" fill=\"{GOOD}\"/>",
            y + height - bar,
        );
        let figure = match row.survival.runs {
            0 => "-".to_owned(),
            _ => row.survival.held.to_string(),
        };
        text(svg, (self.middle(place), y + 19), "middle", &figure);
        svg.push_str("</g>\n");
    }
}

fn text(svg: &mut String, (x, y): (usize, usize), anchor: &str, text: &str) {
    let text = escaped(text);
    let _ = writeln!(
        svg,
        "<text x=\"{x}\" y=\"{y}\" text-anchor=\"{anchor}\">{text}</text>"
    );
}

/// Returns the runs in a line, and a table: a row per value with its figures if one knob is swept,
/// otherwise a row per combination of the slower knobs and a column per value of the fastest.
pub fn markdown(summary: &SweepSummary, theme: &Theme) -> String {
    let mut groups = summary.groups();
    let mut table = match (groups.len(), groups.next()) {
        (1, Some(rows)) => figures(summary, rows),
        _ => counts(summary),
    };
    let head: Vec<String> = map::head(summary, theme)
        .into_iter()
        .map(|(name, text)| format!("{name}: {text}"))
        .collect();
    // The line below the heading: figures are aligned to the right.
    table.insert(1, vec!["---:".to_owned(); table[0].len()]);
    let table: Vec<String> = table.iter().map(|cells| row(cells)).collect();
    format!("{}\n\n{}", head.join("; "), table.join("\n"))
}

/// Returns the rows of one group with their figures, below a heading.
fn figures(summary: &SweepSummary, rows: &[RowSummary]) -> Vec<Vec<String>> {
    let figures = summary::figures(summary);
    let mut head = vec![summary.main.heading(), summary.good.clone()];
    head.extend(figures.iter().map(|of| format!("{}{}", of.name, of.unit)));
    head.extend(summary.parts.iter().map(PartColumn::name));
    let body = rows.iter().map(|row| {
        let mut cells = vec![row.value.clone(), row.survival_text()];
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
        let counts = rows.iter().map(RowSummary::survival_text);
        [name].into_iter().chain(counts).collect()
    });
    [head].into_iter().chain(rows).collect()
}

fn row(cells: &[String]) -> String {
    let cells: Vec<String> = cells.iter().map(|cell| cell.replace('|', "\\|")).collect();
    format!("| {} |", cells.join(" | "))
}
