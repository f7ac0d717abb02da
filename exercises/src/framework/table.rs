//! Figures in rows and columns.

use std::fmt;

use super::Brief;

/// A table of text cells. Its printed columns are as wide as their widest cells.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Table {
    /// Headers of the columns.
    pub headers: Vec<String>,
    /// The rows, each with as many cells as there are headers.
    pub rows: Vec<Vec<String>>,
}

/// Where a prediction stands in a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PredictionPlace {
    /// Between the rows, which begin with values of the quantity in ascending or descending order.
    Between,
    /// Beside the row with this index, whose result was asked for.
    Row(usize),
    /// In a row of its own, in the column with this index.
    Column(usize),
    /// Below the table.
    Below,
    /// Beside the row of the choice.
    Choice,
    /// In the cell with the name of the choice.
    Cell,
}

/// The sign of a prediction in a table.
const SIGN: &str = "◀ you";

/// A column of a table: its header, and its cell in the row of an item.
pub type Column<'c, T> = (&'c str, &'c dyn Fn(&T) -> String);

impl Table {
    /// Creates a table with a row for each of `items`.
    pub fn from_items<T>(items: &[T], columns: &[Column<'_, T>]) -> Self {
        let row = |item| columns.iter().map(|(_, cell)| cell(item)).collect();
        Self {
            headers: columns.iter().map(|(head, _)| (*head).to_owned()).collect(),
            rows: items.iter().map(row).collect(),
        }
    }

    /// Returns the table as text, with a predicted `number` at its `place`.
    pub(super) fn with(&self, place: PredictionPlace, number: f64, brief: &Brief) -> String {
        let predicted = brief.in_unit(number);
        let mut table = self.clone();
        let beside = match place {
            PredictionPlace::Between => return self.between(number, &predicted),
            PredictionPlace::Row(row) => Some((row, format!("  {SIGN}: {predicted}"))),
            PredictionPlace::Below => None,
            PredictionPlace::Choice => Some((number as usize - 1, format!("  {SIGN}"))),
            PredictionPlace::Column(column) => {
                let mut row = vec![String::new(); self.headers.len()];
                row[0] = "you".to_owned();
                row[column] = predicted.clone();
                table.rows.push(row);
                None
            }
            PredictionPlace::Cell => {
                let cells = table.rows.iter_mut().flatten();
                cells
                    .filter(|cell| **cell == predicted)
                    .for_each(|cell| cell.insert_str(0, "▶ "));
                None
            }
        };
        let mut lines = table.lines();
        if place == PredictionPlace::Below {
            lines.push(format!("{} {predicted}  {SIGN}", brief.quantity));
        }
        if let Some((row, text)) = beside {
            lines[row + 1] += &text;
        }
        lines.join("\n") + "\n"
    }

    /// Returns the table with a `number` beside the row that begins with it, or between two rows.
    fn between(&self, number: f64, predicted: &str) -> String {
        let mut lines = self.lines();
        let values = self.rows.iter().map(|row| {
            let value = row[0].split(' ').next();
            value
                .and_then(|value| value.parse().ok())
                .unwrap_or(f64::NAN)
        });
        let values: Vec<f64> = values.collect();
        let rises = values.first() < values.last();
        match values.iter().position(|value| *value == number) {
            Some(row) => lines[row + 1] += &format!("  {SIGN}"),
            None => {
                let is_before = |value: &&f64| (**value < number) == rises;
                let before = values.iter().take_while(is_before).count();
                let wide = self.widths().first().copied().unwrap_or(0);
                lines.insert(before + 1, format!("{predicted:>wide$}  {SIGN}"));
            }
        }
        lines.join("\n") + "\n"
    }

    /// Returns the widths of the columns.
    fn widths(&self) -> Vec<usize> {
        let width = |column: usize| {
            let lines = std::iter::once(&self.headers).chain(&self.rows);
            let cells = lines.filter_map(|line| line.get(column));
            cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
        };
        (0..self.headers.len()).map(width).collect()
    }

    /// Returns the headers and the rows, in a line each.
    fn lines(&self) -> Vec<String> {
        let widths = self.widths();
        let line = |cells: &Vec<String>| {
            let cells = cells.iter().zip(&widths);
            let cells: Vec<String> = cells
                .map(|(cell, width)| format!("{cell:>width$}"))
                .collect();
            cells.join("  ").trim_end().to_owned()
        };
        let lines = std::iter::once(&self.headers).chain(&self.rows);
        lines.map(line).collect()
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut lines = self.lines().into_iter();
        lines.try_for_each(|line| writeln!(f, "{line}"))
    }
}
