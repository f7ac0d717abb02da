//! Rows with commas in between.

/// A row with these cells, quoted by RFC 4180 where a comma, a quote or the end of a line is in
/// one.
pub fn row_of(cells: impl IntoIterator<Item = String>) -> String {
    let cells = cells
        .into_iter()
        .map(|cell| match cell.contains([',', '"', '\n', '\r']) {
            true => format!("\"{}\"", cell.replace('"', "\"\"")),
            false => cell,
        });
    cells.collect::<Vec<_>>().join(",")
}
