//! A learner's prediction before the run.

use std::{collections::HashSet, fmt};

use ratelab_recording::printable::in_line;
use thiserror::Error;

use super::{
    brief::Brief,
    unit::{Unit, in_unit},
};

/// A number and a reason, given before the measurement.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    number: f64,
    reason: String,
    /// The learner's number, where it decides what is measured.
    pub(super) seed: Option<u64>,
}

impl Prediction {
    /// Creates a prediction of `number`, in the unit of the question. The reason is one printable
    /// line: control characters in it are escaped.
    ///
    /// # Errors
    /// [`PredictionError`] if the number is not finite or the reason is empty.
    pub fn new(number: f64, reason: &str) -> Result<Self, PredictionError> {
        let reason = reason.trim();
        if !number.is_finite() {
            return Err(PredictionError::NotFinite(number));
        }
        if !reason.contains(char::is_alphanumeric) {
            return Err(PredictionError::NoReason(number.to_string()));
        }
        Ok(Self {
            number,
            reason: in_line(reason),
            seed: None,
        })
    }

    /// This prediction about the runs drawn from the learner's number `seed`.
    pub fn about(mut self, seed: u64) -> Self {
        self.seed = Some(seed);
        self
    }

    /// Parses a prediction for the exercise of `brief`: a number with a decimal point or
    /// comma, an optional unit, and a reason in any words. Where the question has choices,
    /// one of them takes the place of the number.
    ///
    /// # Errors
    /// [`PredictionError`] if the number or the reason is missing, the unit belongs to
    /// another quantity, or the number is impossible.
    pub fn read(text: &str, brief: &Brief) -> Result<Self, PredictionError> {
        let (text, unit) = (text.trim(), &brief.unit);
        if text.is_empty() {
            return Err(PredictionError::Empty(expected(brief)));
        }
        if !brief.choices.is_empty() {
            return Self::choose(text, brief);
        }
        let not_one = || PredictionError::NoNumber(text.to_owned(), expected(brief));
        let (number, rest) = split_number(text).ok_or_else(not_one)?;
        let (number, reason) = convert(number, rest, brief)?;
        if goes_on_with_a_number(reason) {
            return Err(not_one());
        }
        if !brief.range.contains(number) {
            return Err(PredictionError::Impossible {
                number: in_unit(number, unit),
                possible: brief.range.in_words(unit),
            });
        }
        Self::reasoned(number, reason, brief)
    }

    /// Reads the choice at the start of `text`, with a reason.
    fn choose(text: &str, brief: &Brief) -> Result<Self, PredictionError> {
        let begins = |choice: &str| {
            let (start, rest) = text.split_at_checked(choice.len())?;
            let whole = !rest.starts_with(char::is_alphanumeric);
            (start.eq_ignore_ascii_case(choice) && whole).then_some(rest)
        };
        let chosen = (1_u32..)
            .zip(&brief.choices)
            .find_map(|(number, choice)| Some((number, begins(choice)?)));
        let (number, reason) =
            chosen.ok_or_else(|| PredictionError::NoNumber(text.to_owned(), expected(brief)))?;
        Self::reasoned(number.into(), reason, brief)
    }

    /// Creates a prediction, with its reason at the start of `reason`.
    fn reasoned(number: f64, reason: &str, brief: &Brief) -> Result<Self, PredictionError> {
        let reason = without_because(reason).trim();
        if is_reason(reason) {
            return Self::new(number, reason);
        }
        let number = brief.in_unit(number);
        match words(reason).next() {
            None => Err(PredictionError::NoReason(number)),
            Some(_) => Err(PredictionError::ShortReason(reason.to_owned(), number)),
        }
    }

    /// Returns whether the reason is more than a word. A file may hold another one.
    pub fn is_reasoned(&self) -> bool {
        is_reason(&self.reason)
    }

    /// Returns the number, in the unit of the question.
    pub fn number(&self) -> f64 {
        self.number
    }

    /// Returns the reason.
    pub fn reason(&self) -> &str {
        &self.reason
    }

    /// Returns the learner's number; zero where none was given.
    pub fn seed(&self) -> u64 {
        self.seed.unwrap_or_default()
    }
}

impl fmt::Display for Prediction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} because {}", self.number, self.reason)
    }
}

/// Letters of a reason, in all its words and units.
const LETTERS: usize = 4;

/// Returns whether `text` is more than a word or a few letters.
fn is_reason(text: &str) -> bool {
    let different: HashSet<String> = words(text).map(str::to_lowercase).collect();
    let letters = text.chars().filter(|c| c.is_alphabetic()).count();
    different.len() > 1 && letters >= LETTERS
}

/// Returns the words of `text`, without numbers and units. In a script without capitals, such as
/// Chinese, which has no spaces either, each letter counts as a word.
fn words(text: &str) -> impl Iterator<Item = &str> {
    let has_case = |c: char| c.is_lowercase() || c.is_uppercase();
    let end = move |c: char| !has_case(c);
    text.split(|c: char| !c.is_alphabetic())
        .flat_map(move |word| word.split_inclusive(end))
        .filter(|word| !word.is_empty() && Unit::named(word).is_none())
}

/// Returns the expected form of a prediction.
fn asked(brief: &Brief) -> String {
    match (&brief.choices[..], &*brief.unit) {
        ([], "") => "a number".to_owned(),
        ([], unit) => format!("a number in {unit}"),
        (choices, _) => format!("one of {}", choices.join(", ")),
    }
}

/// Returns the expected form with a reason, and an example.
fn expected(brief: &Brief) -> String {
    let example = brief.choices.first().map_or("N", String::as_str);
    format!("{} and a reason, as in {example} because …", asked(brief))
}

/// Returns the number at the start of `text`, and the rest.
fn split_number(text: &str) -> Option<(f64, &str)> {
    let unsigned = text.strip_prefix(['-', '+']).unwrap_or(text);
    let digits = |text: &str| text.bytes().take_while(u8::is_ascii_digit).count();
    let mut end = text.len() - unsigned.len() + digits(unsigned);
    // A point, a comma or an exponent is part of the number if a digit follows.
    for (signs, marks) in [(&[][..], &['.', ','][..]), (&['-', '+'], &['e', 'E'])] {
        let fraction = text[end..]
            .strip_prefix(marks)
            .map(|rest| rest.strip_prefix(signs).unwrap_or(rest));
        if let Some(rest) = fraction.filter(|rest| digits(rest) > 0) {
            end = text.len() - rest.len() + digits(rest);
        }
    }
    let (number, rest) = text.split_at(end);
    Some((number.replace(',', ".").parse().ok()?, rest))
}

/// Returns `number` in the unit of the question, and the rest after its unit.
fn convert<'t>(
    number: f64,
    rest: &'t str,
    brief: &Brief,
) -> Result<(f64, &'t str), PredictionError> {
    let spaceless = rest.trim_start();
    let part = |c: char| c.is_alphanumeric() || "%°".contains(c);
    let end = spaceless.find(|c| !part(c)).unwrap_or(spaceless.len());
    let (word, after) = spaceless.split_at(end);
    let unit = Unit::named(word).filter(|_| !word.is_empty());
    let asked = Unit::named(&brief.unit);
    let converted = unit
        .zip(asked)
        .and_then(|(unit, asked)| unit.convert(number, asked));
    match converted {
        Some(number) => Ok((number, after)),
        // Letters directly after a number must be its unit.
        None if unit.is_some() || rest.starts_with(|c: char| c.is_ascii_alphabetic()) => {
            Err(PredictionError::Unit(word.to_owned(), self::asked(brief)))
        }
        None => Ok((number, rest)),
    }
}

/// Returns whether a second number follows the first, as in `5-10` or `5 10`.
fn goes_on_with_a_number(rest: &str) -> bool {
    let gap = rest.trim_start();
    let next = gap
        .strip_prefix(['-', '–', '/'])
        .map(str::trim_start)
        .or_else(|| rest.strip_prefix(['.', ',']))
        .unwrap_or(gap);
    next.starts_with(|c: char| c.is_ascii_digit())
}

/// Returns a reason without the separator and the `because` before it.
fn without_because(reason: &str) -> &str {
    const BECAUSE: &str = "because";
    let reason = reason.trim_start_matches([' ', ',', ':', ';', '.', '-', '–', '—']);
    match reason.get(..BECAUSE.len()) {
        Some(word) if word.eq_ignore_ascii_case(BECAUSE) => &reason[BECAUSE.len()..],
        _ => reason,
    }
}

/// An invalid prediction.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PredictionError {
    /// Empty input.
    #[error("no prediction yet: expected {0}")]
    Empty(String),
    /// Input without a single number at its start.
    #[error("{0:?}: expected {1}")]
    NoNumber(String, String),
    /// A number that is infinite or NaN.
    #[error("{0} is not a finite number")]
    NotFinite(f64),
    /// A unit of another quantity.
    #[error("{0:?} is not a unit here: expected {1}")]
    Unit(String, String),
    /// A result that the exercise cannot have.
    #[error("{number} is impossible here: expected {possible}")]
    Impossible {
        /// The number and its unit.
        number: String,
        /// The possible numbers.
        possible: String,
    },
    /// A number or a choice without a reason.
    #[error("{0} is without a reason: add one, as in {0} because …")]
    NoReason(String),
    /// A number or a choice with a word that is not a reason.
    #[error("{0:?} is too short for a reason: say why in a few words, as in {1} because …")]
    ShortReason(String, String),
}
