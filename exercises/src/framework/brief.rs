//! The text of a question, and the place of its prediction in a table of figures.

use ratelab_experiment::Table;
use serde::Deserialize;

use super::unit::in_unit;

/// The text for the learner before the run, from `questions.toml`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Brief {
    /// Number in the course, counted from one.
    pub number: u32,
    /// A letter for each question of an exercise with several; otherwise empty.
    #[serde(default)]
    pub part: String,
    /// A one-word name, for files.
    pub name: String,
    /// Its title.
    pub title: String,
    /// Whether it is on the path of an hour.
    #[serde(default)]
    pub path: bool,
    /// Kind of the exercise, such as "predict, then run".
    pub kind: String,
    /// The subject, and the planned runs.
    pub objective: String,
    /// The question: one number to predict, or one of the choices.
    pub question: String,
    /// The quantity that the number is of, in a word or two.
    pub quantity: String,
    /// Unit of the number; empty for a count.
    #[serde(default)]
    pub unit: String,
    /// How near a right prediction comes.
    pub tolerance: Tolerance,
    /// Whether the limits of the push age give the answer away: the screen hides them until the
    /// first prediction.
    #[serde(default)]
    pub asks_limits: bool,
    /// The possible numbers of a question about a number.
    #[serde(default)]
    pub range: Range,
    /// The possible answers in words, numbered from one; empty for a question about a
    /// number.
    #[serde(default)]
    pub choices: Vec<String>,
    /// What helps without the answer.
    #[serde(default)]
    pub hint: String,
    /// What is replied to a prediction.
    #[serde(default)]
    pub replies: Replies,
}

/// Replies to a prediction, beside the measurement; one that is empty cannot be needed.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Replies {
    /// To a right one.
    pub right: String,
    /// To one that is too high.
    pub above: String,
    /// To one that is too low.
    pub below: String,
    /// To another choice than the right one.
    pub other: String,
}

impl Brief {
    /// Returns the number with the letter of the question, such as `6b`.
    pub fn label(&self) -> String {
        format!("{}{}", self.number, self.part)
    }

    /// Returns `number` with the unit of the question, or the choice of that number.
    pub fn in_unit(&self, number: f64) -> String {
        let index = (number as usize).checked_sub(1);
        match index.and_then(|index| self.choices.get(index)) {
            Some(choice) => choice.clone(),
            None => in_unit(number, &self.unit),
        }
    }

    /// Returns the question, with how near a right number comes, or with the choices.
    pub fn asked(&self) -> String {
        let answer = match &self.choices[..] {
            [] => self.tolerance.in_words(&self.quantity, &self.unit),
            choices => format!("One of: {}.", choices.join(", ")),
        };
        format!("{}\n{answer}", self.question)
    }
}

/// The possible results of an exercise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Range {
    /// The least number.
    pub least: f64,
    /// The greatest number.
    pub most: f64,
    /// Whether only whole numbers are possible.
    #[serde(default)]
    pub whole: bool,
}

impl Range {
    /// Returns whether `number` is possible.
    pub fn contains(self, number: f64) -> bool {
        (self.least..=self.most).contains(&number) && (!self.whole || number.fract() == 0.0)
    }

    /// Returns the possible numbers as text, in `unit`.
    pub(super) fn in_words(self, unit: &str) -> String {
        let kind = if self.whole { "a whole number, " } else { "" };
        format!("{kind}{} to {}", self.least, in_unit(self.most, unit))
    }
}

/// How near a right prediction comes. The question states it, so that nobody is wrong by
/// a rounding.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Tolerance {
    /// The measured number itself, or the right choice.
    Exact,
    /// At most this far from the measured number, in the unit of the question.
    Within(f64),
    /// Anywhere from the last tested number that holds to the first that fails.
    Between,
}

impl Tolerance {
    /// Returns the largest error of a right prediction.
    pub(super) fn within(self) -> f64 {
        match self {
            Self::Within(within) => within,
            Self::Exact | Self::Between => 0.0,
        }
    }

    /// Returns the rule as a sentence, about a `quantity` in `unit`.
    fn in_words(self, quantity: &str, unit: &str) -> String {
        match self {
            Self::Exact => "Counts as right: the exact number.".to_owned(),
            Self::Within(within) => {
                let within = in_unit(within, unit);
                format!("Counts as right: within {within} of the measurement.")
            }
            Self::Between => format!(
                "Counts as right: any {quantity} from the last that worked to the first that failed."
            ),
        }
    }
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
