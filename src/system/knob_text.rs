//! Knobs as lines of text, with the names that a system has for some.

use thiserror::Error;

use super::{
    Alias,
    comment::{escaped, uncommented, unescaped},
};
use crate::runtime::{Knob, KnobError, KnobKind, Time, TimedKnob};

/// Reads and writes knobs with the aliases of a system. The name of an alias may
/// be written with underscores for hyphens.
///
/// ```
/// use ratelab::cartpole::CartPole;
///
/// let text = CartPole::KNOBS;
/// let knobs = text.parse_list("1 queue-depth 8 # both topics\n2.5 rate policy 10")?;
/// assert_eq!(knobs.len(), 3);
/// assert_eq!(text.lines(&knobs), ["1 queue-depth 8", "2.5 control-hz 10"]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct KnobText(pub &'static [Alias]);

impl KnobText {
    /// The alias called `name`.
    pub fn alias(&self, name: &str) -> Option<&'static Alias> {
        let name = name.replace('_', "-");
        self.0.iter().find(|alias| alias.name == name)
    }

    /// The knobs that `text` turns, such as `rate planner 10`, or an alias and a
    /// value.
    ///
    /// # Errors
    /// [`KnobTextError`] if it is no knob or does not take the value.
    pub fn parse(&self, text: &str) -> Result<Vec<Knob>, KnobTextError> {
        let text = text.trim();
        let (word, value) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
        if KnobKind::ALL.iter().any(|kind| kind.name() == word) {
            return Ok(vec![text.parse()?]);
        }
        let alias = self.alias(word).ok_or_else(|| self.unknown(word))?;
        let value = value.trim_start();
        let words = !alias.kind().takes_words() && value.contains(char::is_whitespace);
        if value.is_empty() || words {
            return Err(KnobTextError::Shape {
                text: text.to_owned(),
                name: alias.name,
                value: alias.kind().value_name(),
            });
        }
        Ok(alias.set(value)?)
    }

    /// The knobs of a line with a run time (s) before them, such as
    /// `2.5 rate planner 10`. A `#` that would begin a comment is `\#`.
    ///
    /// # Errors
    /// [`KnobTextError`] if it is none.
    pub fn parse_timed(&self, line: &str) -> Result<Vec<TimedKnob>, KnobTextError> {
        let line = unescaped(line.trim());
        let words = line.split_once(char::is_whitespace);
        let words = words.filter(|(_, knob)| knob.trim().contains(char::is_whitespace));
        let (at, knob) = words.ok_or_else(|| KnobTextError::Timed(line.clone()))?;
        let seconds = at.parse().ok();
        let time = seconds.and_then(|seconds: f64| Time::from_secs_f64(seconds).ok());
        let at = time.ok_or_else(|| KnobTextError::Time(at.to_owned()))?;
        let knobs = self.parse(knob)?.into_iter();
        Ok(knobs.map(|knob| TimedKnob { at, knob }).collect())
    }

    /// The knobs of a list, one line each. Empty lines and comments do not count:
    /// from a `#` at the start of a line or after white space to its end.
    ///
    /// # Errors
    /// [`KnobTextError::Line`] names the first line that is not understood.
    pub fn parse_list(&self, text: &str) -> Result<Vec<TimedKnob>, KnobTextError> {
        let mut knobs = Vec::new();
        for (number, line) in (1..).zip(text.lines()) {
            let content = uncommented(line).trim();
            if content.is_empty() {
                continue;
            }
            let parsed = self.parse_timed(content);
            knobs.extend(parsed.map_err(|error| KnobTextError::Line {
                line: number,
                error: Box::new(error),
            })?);
        }
        Ok(knobs)
    }

    /// `knobs` as lines that can be read again, by their aliases where they have
    /// one.
    pub fn lines(&self, knobs: &[TimedKnob]) -> Vec<String> {
        let (mut lines, mut rest) = (Vec::new(), knobs);
        while let Some(first) = rest.first() {
            let (text, count) = self.first_line(first, rest);
            lines.push(format!("{} {}", seconds(first.at), escaped(&text)));
            rest = rest.get(count..).unwrap_or_default();
        }
        lines
    }

    /// What the first of `knobs` is called, and how many of them that covers.
    fn first_line(&self, first: &TimedKnob, knobs: &[TimedKnob]) -> (String, usize) {
        let aliases = self.0.iter();
        let mut named = aliases.filter_map(|alias| Some((alias, alias.value_of(knobs)?)));
        match named.next() {
            Some((alias, value)) => (format!("{} {value}", alias.name), alias.knobs.len()),
            None => (first.knob.to_string(), 1),
        }
    }

    /// The kind of the knob that begins with `name`: an alias, or a kind and a target.
    ///
    /// # Errors
    /// [`KnobTextError::Name`] if there is no such knob.
    pub fn kind(&self, name: &str) -> Result<KnobKind, KnobTextError> {
        let word = name.split_whitespace().next().unwrap_or_default();
        let generic = KnobKind::ALL.into_iter().find(|kind| kind.name() == word);
        let kind = generic.or_else(|| self.alias(word).map(Alias::kind));
        kind.ok_or_else(|| self.unknown(word))
    }

    fn unknown(&self, name: &str) -> KnobTextError {
        let aliases = self.0.iter().map(|alias| alias.name);
        let names: Vec<&str> = aliases.chain(KnobKind::ALL.map(KnobKind::name)).collect();
        let (last, others) = names.split_last().unwrap_or((&"", &[]));
        KnobTextError::Name {
            name: name.to_owned(),
            known: format!("{} or {last}", others.join(", ")),
        }
    }
}

/// Exact seconds.
fn seconds(at: Time) -> String {
    let nanos = at.as_nanos();
    let decimals = format!("{:09}", nanos % 1_000_000_000);
    let decimals = decimals.trim_end_matches('0');
    let point = if decimals.is_empty() { "" } else { "." };
    format!("{}{point}{decimals}", nanos / 1_000_000_000)
}

/// Text that turns no knob.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum KnobTextError {
    /// The value of an alias is missing, or there are too many words.
    #[error("{text:?} is not a knob: expected {name} {value}")]
    Shape {
        /// What was given.
        text: String,
        /// The alias.
        name: &'static str,
        /// What its value is.
        value: &'static str,
    },
    /// A line of a list lacks words.
    #[error(
        "{0:?} is not a timed knob: expected seconds, knob and value, such as 2.5 rate NODE 10"
    )]
    Timed(String),
    /// The first word is no time.
    #[error("{0:?} is not a time: expected seconds, zero or more")]
    Time(String),
    /// There is no knob of this name.
    #[error("{name:?} is not a knob: expected {known}")]
    Name {
        /// What was given.
        name: String,
        /// What there is.
        known: String,
    },
    /// The knob does not take the value.
    #[error(transparent)]
    Value(#[from] KnobError),
    /// Where in a list the error is.
    #[error("line {line}: {error}")]
    Line {
        /// Line number, counted from one.
        line: usize,
        /// What is wrong with it.
        error: Box<KnobTextError>,
    },
}
