//! The printed table.

use std::fmt;

use super::paired::{Nanos, Paired};

/// Rows under headings, aligned on printing.
#[derive(Default)]
pub struct Table(Vec<Row>);

enum Row {
    Heading(String),
    Cells([String; COLUMNS]),
}

const COLUMNS: usize = 6;

const TITLES: [&str; COLUMNS] = ["", "ours", "beside", "ratio", "goal", ""];

impl Table {
    /// Adds a heading for the next rows.
    pub fn heading(&mut self, text: impl Into<String>) {
        self.0.push(Row::Heading(text.into()));
    }

    /// Adds a row with a pair of times, and the goal for their ratio if there is one.
    pub fn row(&mut self, what: &str, paired: &Paired, goal: Option<f64>) {
        let cells = [text(paired.ours), text(paired.floor)];
        self.cells(what, cells, paired.ratio, goal);
    }

    /// Adds a row with the rates of a pair of times. The ratio is one of times, as elsewhere.
    pub fn rates(&mut self, what: &str, paired: &Paired, goal: Option<f64>) {
        let rate = |time: Nanos| format!("{:.0}/s", 1e9 / time);
        let cells = [rate(paired.ours), rate(paired.floor)];
        self.cells(what, cells, paired.ratio, goal);
    }

    /// Adds a row with two figures of any unit.
    pub fn cells(
        &mut self,
        what: &str,
        [ours, beside]: [String; 2],
        ratio: f64,
        goal: Option<f64>,
    ) {
        let verdict = goal.map(|goal| if ratio <= goal { "met" } else { "missed" });
        self.0.push(Row::Cells([
            what.to_owned(),
            ours,
            beside,
            format!("{ratio:.3}"),
            goal.map_or_else(String::new, |goal| format!("≤ {goal}")),
            verdict.unwrap_or_default().to_owned(),
        ]));
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let titles = TITLES.map(str::to_owned);
        let rows = self.0.iter().filter_map(|row| match row {
            Row::Cells(cells) => Some(cells),
            Row::Heading(_) => None,
        });
        let widths: [usize; COLUMNS] = std::array::from_fn(|column| {
            let cells = rows.clone().chain([&titles]);
            cells
                .map(|row| row[column].chars().count())
                .max()
                .unwrap_or(0)
        });
        line(f, &titles, &widths)?;
        self.0.iter().try_for_each(|row| match row {
            Row::Heading(text) => writeln!(f, "\n{text}"),
            Row::Cells(cells) => line(f, cells, &widths),
        })
    }
}

/// One row: the first and the last column left-aligned, figures right-aligned.
fn line(f: &mut fmt::Formatter<'_>, row: &[String; COLUMNS], widths: &[usize]) -> fmt::Result {
    let [what, figures @ .., verdict] = row;
    write!(f, "  {what:<width$}", width = widths[0])?;
    for (figure, width) in figures.iter().zip(&widths[1..]) {
        write!(f, "  {figure:>width$}")?;
    }
    writeln!(f, "  {verdict}")
}

/// A time with three or four digits.
pub fn text(nanos: Nanos) -> String {
    match nanos {
        ..100.0 => format!("{nanos:.1} ns"),
        100.0..1e4 => format!("{nanos:.0} ns"),
        1e4..1e6 => format!("{:.1} µs", nanos / 1e3),
        _ => format!("{:.3} ms", nanos / 1e6),
    }
}
