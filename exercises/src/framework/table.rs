//! A prediction in a table of figures.

use ratelab_experiment::Table;

use super::Brief;

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

impl PredictionPlace {
    /// Returns the `table` as text, with a predicted `number` at its place.
    pub(super) fn drawn(self, table: &Table, number: f64, brief: &Brief) -> String {
        let predicted = brief.in_unit(number);
        let mut table = table.clone();
        let beside = match self {
            Self::Between => return between(&table, number, &predicted),
            Self::Row(row) => Some((row, format!("  {SIGN}: {predicted}"))),
            Self::Below => None,
            Self::Choice => Some((number as usize - 1, format!("  {SIGN}"))),
            Self::Column(column) => {
                let mut row = vec![String::new(); table.headers.len()];
                row[0] = "you".to_owned();
                row[column] = predicted.clone();
                table.rows.push(row);
                None
            }
            Self::Cell => {
                let cells = table.rows.iter_mut().flatten();
                cells
                    .filter(|cell| **cell == predicted)
                    .for_each(|cell| cell.insert_str(0, "▶ "));
                None
            }
        };
        let mut lines = table.lines();
        if self == Self::Below {
            lines.push(format!("{} {predicted}  {SIGN}", brief.quantity));
        }
        if let Some((row, text)) = beside {
            lines[row + 1] += &text;
        }
        lines.join("\n") + "\n"
    }
}

/// Returns the `table` with a `number` beside the row that begins with it, or between two rows.
fn between(table: &Table, number: f64, predicted: &str) -> String {
    let mut lines = table.lines();
    let values: Vec<f64> = table
        .rows
        .iter()
        .map(|row| {
            let value = row[0].split(' ').next();
            value
                .and_then(|value| value.parse().ok())
                .unwrap_or(f64::NAN)
        })
        .collect();
    let rises = values.first() < values.last();
    match values.iter().position(|value| *value == number) {
        Some(row) => lines[row + 1] += &format!("  {SIGN}"),
        None => {
            let is_before = |value: &&f64| (**value < number) == rises;
            let before = values.iter().take_while(is_before).count();
            let wide = table.widths().first().copied().unwrap_or(0);
            lines.insert(before + 1, format!("{predicted:>wide$}  {SIGN}"));
        }
    }
    lines.join("\n") + "\n"
}
