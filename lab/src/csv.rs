//! Rows with commas in between.

use crate::printable::in_line;

/// Returns a row with these cells, printable, and quoted by RFC 4180 where a comma or a quote is in
/// one.
pub fn row_of(cells: impl IntoIterator<Item = String>) -> String {
    cells
        .into_iter()
        .map(|cell| match in_line(&cell) {
            cell if cell.contains([',', '"']) => format!("\"{}\"", cell.replace('"', "\"\"")),
            cell => cell,
        })
        .collect::<Vec<_>>()
        .join(",")
}
