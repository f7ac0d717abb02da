//! Tables of cases, as text: a row for each, which names it in a failure.

/// The rows of `table` with their cells, which ` | ` separates; `\n` in a cell is a line feed.
pub fn rows<const N: usize>(table: &str) -> impl Iterator<Item = [String; N]> {
    let rows = table.lines().map(str::trim).filter(|row| !row.is_empty());
    rows.map(|row| {
        let row = format!("{row} ");
        let cells = row.split("| ").map(|cell| cell.trim().replace(r"\n", "\n"));
        let cells: Vec<_> = cells.collect();
        cells.try_into().unwrap_or_else(|cells| panic!("{cells:?}"))
    })
}
