//! Figures in rows and columns, as text.

use std::{fmt, iter};

/// A table of text cells. Its printed columns are as wide as their widest cells.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Table {
    /// Headers of the columns.
    pub headers: Vec<String>,
    /// The rows, each with as many cells as there are headers.
    pub rows: Vec<Vec<String>>,
    /// Whether the first column has names, which begin at the left: figures end at the right.
    pub named: bool,
}

/// A column of a table: its header, and its cell in the row of an item.
pub type Column<'c, T> = (&'c str, &'c dyn Fn(&T) -> String);

impl Table {
    /// Creates a table with a row for each of `items`.
    pub fn from_items<T>(items: &[T], columns: &[Column<'_, T>]) -> Self {
        let row = |item| columns.iter().map(|(_, cell)| cell(item)).collect();
        Self {
            headers: columns.iter().map(|(head, _)| (*head).to_owned()).collect(),
            rows: items.iter().map(row).collect(),
            named: false,
        }
    }

    /// Returns the widths of the columns.
    pub fn widths(&self) -> Vec<usize> {
        let width = |column: usize| {
            iter::once(&self.headers)
                .chain(&self.rows)
                .filter_map(|line| line.get(column))
                .map(|cell| cell.chars().count())
                .max()
                .unwrap_or(0)
        };
        (0..self.headers.len()).map(width).collect()
    }

    /// Returns the headers and the rows, in a line each.
    pub fn lines(&self) -> Vec<String> {
        let widths = self.widths();
        let line = |cells: &Vec<String>| {
            let padded = cells
                .iter()
                .zip(&widths)
                .enumerate()
                .map(|(column, (cell, width))| {
                    if self.named && column == 0 {
                        format!("{cell:<width$}")
                    } else {
                        format!("{cell:>width$}")
                    }
                });
            let line = padded.collect::<Vec<_>>().join("  ");
            line.trim_end().to_owned()
        };
        iter::once(&self.headers)
            .chain(&self.rows)
            .map(line)
            .collect()
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.lines()
            .into_iter()
            .try_for_each(|line| writeln!(f, "{line}"))
    }
}
