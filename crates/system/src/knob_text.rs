//! Knobs as lines of text, with a system's aliases, and comments in lists of them: from a `#` at
//! the start of a line or after white space to the end of the line. In a path such a `#` is written
//! `\#`.

use ratelab::{Knob, KnobError, KnobKind, Time, TimedKnob, alternatives};
use thiserror::Error;

use crate::Alias;

/// Reads and writes knobs with the aliases of a system. Names of aliases may be written
/// with underscores instead of hyphens.
///
/// ```
/// use ratelab::KnobKind::{Depth, Rate};
/// use ratelab_system::{Alias, KnobText};
///
/// let text = KnobText(&[
///     Alias {
///         name: "control-hz",
///         knobs: &[(Rate, "policy")],
///         default: "50",
///         choices: &[],
///         help: "",
///     },
///     Alias {
///         name: "queue-depth",
///         knobs: &[(Depth, "/obs"), (Depth, "/action")],
///         default: "1",
///         choices: &[],
///         help: "",
///     },
/// ]);
/// let knobs = text.parse_list("1 queue-depth 8 # both topics\n2.5 rate policy 10")?;
/// assert_eq!(knobs.len(), 3);
/// assert_eq!(text.lines(&knobs), ["1 queue-depth 8", "2.5 control-hz 10"]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct KnobText(pub &'static [Alias]);

impl KnobText {
    /// Returns the alias called `name`.
    pub fn alias(&self, name: &str) -> Option<&'static Alias> {
        let name = name.replace('_', "-");
        self.0.iter().find(|alias| alias.name == name)
    }

    /// Parses a knob, such as `rate planner 10`, or an alias and a value.
    ///
    /// # Errors
    /// [`KnobTextError`] for an unknown knob or an invalid value.
    pub fn parse(&self, text: &str) -> Result<Vec<Knob>, KnobTextError> {
        let text = text.trim();
        let (word, value) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
        if KnobKind::ALL.iter().any(|kind| kind.name() == word) {
            return Ok(vec![text.parse()?]);
        }
        let alias = self.alias(word).ok_or_else(|| self.unknown(word))?;
        let value = alias.without_node(value.trim_start());
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

    /// Parses a line with a run time (s) before the knob, such as `2.5 rate planner 10`.
    /// A `#` that would begin a comment is written `\#`.
    ///
    /// # Errors
    /// [`KnobTextError`] for an invalid line.
    pub fn parse_timed(&self, line: &str) -> Result<Vec<TimedKnob>, KnobTextError> {
        let line = unescaped(line.trim());
        let words = line
            .split_once(char::is_whitespace)
            .filter(|(_, knob)| knob.trim().contains(char::is_whitespace));
        let (at, knob) = words.ok_or_else(|| KnobTextError::Timed(line.clone()))?;
        let seconds = at.parse().ok();
        let at = seconds
            .and_then(|seconds: f64| Time::from_secs_f64(seconds).ok())
            .ok_or_else(|| KnobTextError::Time(at.to_owned()))?;
        Ok(self
            .parse(knob)?
            .into_iter()
            .map(|knob| TimedKnob { at, knob })
            .collect())
    }

    /// Parses a list of knobs, one per line. Ignores empty lines and comments: from a `#`
    /// at the start of a line or after white space to its end.
    ///
    /// # Errors
    /// [`KnobTextError::Line`] with the first invalid line.
    pub fn parse_list(&self, text: &str) -> Result<Vec<TimedKnob>, KnobTextError> {
        Ok(self
            .parse_lines(text)?
            .into_iter()
            .map(|(_, knob)| knob)
            .collect())
    }

    /// Parses a list, each knob with the number of its line, counted from one.
    ///
    /// # Errors
    /// As of [`parse_list`](Self::parse_list).
    pub fn parse_lines(&self, text: &str) -> Result<Vec<(usize, TimedKnob)>, KnobTextError> {
        let mut knobs = Vec::new();
        for (number, line) in (1..).zip(text.lines()) {
            let content = uncommented(line).trim();
            if content.is_empty() {
                continue;
            }
            let parsed = self
                .parse_timed(content)
                .map_err(|error| KnobTextError::Line {
                    line: number,
                    error: Box::new(error),
                })?;
            knobs.extend(parsed.into_iter().map(|knob| (number, knob)));
        }
        Ok(knobs)
    }

    /// Writes `knobs` as lines that can be parsed again, with aliases where possible.
    pub fn lines(&self, knobs: &[TimedKnob]) -> Vec<String> {
        let (mut lines, mut rest) = (Vec::new(), knobs);
        while let Some(first) = rest.first() {
            let (text, count) = self.first_line(first, rest);
            lines.push(format!("{} {}", seconds(first.at), escaped(&text)));
            rest = rest.get(count..).unwrap_or_default();
        }
        lines
    }

    /// Returns the line for the first of `knobs`, and the number of knobs it covers.
    fn first_line(&self, first: &TimedKnob, knobs: &[TimedKnob]) -> (String, usize) {
        let mut named = self
            .0
            .iter()
            .filter_map(|alias| Some((alias, alias.value_of(knobs)?)));
        match named.next() {
            Some((alias, value)) => (format!("{} {value}", alias.name), alias.knobs.len()),
            None => (first.knob.to_string(), 1),
        }
    }

    /// Returns the kind of the knob that begins with `name`: an alias, or a kind and a target.
    ///
    /// # Errors
    /// [`KnobTextError::Name`] for an unknown knob.
    pub fn kind(&self, name: &str) -> Result<KnobKind, KnobTextError> {
        let word = name.split_whitespace().next().unwrap_or_default();
        let generic = KnobKind::ALL.into_iter().find(|kind| kind.name() == word);
        let kind = generic.or_else(|| self.alias(word).map(Alias::kind));
        kind.ok_or_else(|| self.unknown(word))
    }

    fn unknown(&self, name: &str) -> KnobTextError {
        let names: Vec<&str> = self
            .0
            .iter()
            .map(|alias| alias.name)
            .chain(KnobKind::ALL.map(KnobKind::name))
            .collect();
        if name.parse::<f64>().is_ok() {
            return KnobTextError::HasTime(name.to_owned());
        }
        KnobTextError::Name {
            name: name.to_owned(),
            known: alternatives(&names),
        }
    }
}

/// Seconds, exact to the nanosecond.
fn seconds(at: Time) -> String {
    let nanos = at.as_nanos();
    let decimals = format!("{:09}", nanos % 1_000_000_000);
    let decimals = decimals.trim_end_matches('0');
    let point = if decimals.is_empty() { "" } else { "." };
    format!("{}{point}{decimals}", nanos / 1_000_000_000)
}

/// An error in the text of a knob.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum KnobTextError {
    /// Missing or superfluous words after an alias.
    #[error("{text:?} is not a knob: expected {name} {value}")]
    Shape {
        /// The given text.
        text: String,
        /// The alias.
        name: &'static str,
        /// Placeholder of its value.
        value: &'static str,
    },
    /// Missing words in a line of a list.
    #[error(
        "{0:?} is not a timed knob: expected seconds, knob and value, such as 2.5 rate NODE 10"
    )]
    Timed(String),
    /// An invalid time.
    #[error("{0:?} is not a time: expected seconds, zero or more")]
    Time(String),
    /// A run time before a knob that has none.
    #[error(
        "a knob has no time here, and {0:?} is one: leave it out, or put the line into a file for \
         --knobs"
    )]
    HasTime(String),
    /// An unknown knob.
    #[error("{name:?} is not a knob: expected {known}")]
    Name {
        /// The given name.
        name: String,
        /// The known names.
        known: String,
    },
    /// An invalid value for the knob.
    #[error(transparent)]
    Value(#[from] KnobError),
    /// An error with its line in a list.
    #[error("line {line}: {error}")]
    Line {
        /// Line number, counted from one.
        line: usize,
        /// The error.
        error: Box<KnobTextError>,
    },
}

/// Returns the possible starts of comments in `line`, ignoring backslashes before the `#`: the
/// position of each, and its number of backslashes.
fn hashes(line: &str) -> impl Iterator<Item = (usize, usize)> {
    line.match_indices('#').filter_map(|(place, _)| {
        let before = line.get(..place).unwrap_or_default();
        let bare = before.trim_end_matches('\\');
        let begins = bare.is_empty() || bare.ends_with(char::is_whitespace);
        begins.then(|| (place, before.len() - bare.len()))
    })
}

/// `line` without its comment.
pub(super) fn uncommented(line: &str) -> &str {
    let comment = hashes(line).find(|(_, backslashes)| *backslashes == 0);
    comment
        .and_then(|(place, _)| line.get(..place))
        .unwrap_or(line)
}

/// `text` with one more backslash before each `#` that would begin a comment.
pub(super) fn escaped(text: &str) -> String {
    let mut escaped = text.to_owned();
    let places: Vec<usize> = hashes(text).map(|(place, _)| place).collect();
    for place in places.into_iter().rev() {
        escaped.insert(place, '\\');
    }
    escaped
}

/// `text` with one backslash less before each `#` that would begin a comment.
pub(super) fn unescaped(text: &str) -> String {
    let mut unescaped = text.to_owned();
    let places: Vec<usize> = hashes(text)
        .filter(|(_, backslashes)| *backslashes > 0)
        .map(|(place, _)| place - 1)
        .collect();
    for place in places.into_iter().rev() {
        unescaped.remove(place);
    }
    unescaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_comment_begins_at_a_hash_after_white_space_that_has_no_backslash() {
        for (line, expected) in [
            ("1 rate a 5 # slow", "1 rate a 5 "),
            ("# all", ""),
            ("1 send a file#2", "1 send a file#2"),
            (r"1 send a \#2", r"1 send a \#2"),
            (r"1 send a \\#2 # x", r"1 send a \\#2 "),
        ] {
            assert_eq!(uncommented(line), expected, "{line}");
        }
    }

    #[test]
    fn a_text_with_hashes_comes_back_from_a_line() {
        for text in ["send a #2", r"send a \#2", r"send a x#2 \\#3 #", "rate a 5"] {
            let line = escaped(text);
            assert_eq!(uncommented(&line), line, "{text}");
            assert_eq!(unescaped(&line), text);
        }
    }

    #[test]
    fn run_times_are_written_exact_and_without_zeros_at_their_end() {
        for (nanos, expected) in [
            (0, "0"),
            (2_500_000_000, "2.5"),
            (1, "0.000000001"),
            (30_000_000_000, "30"),
        ] {
            assert_eq!(seconds(Time::from_nanos(nanos)), expected);
        }
    }

    #[test]
    fn a_line_that_is_no_knob_says_what_is_expected() {
        for (list, expected) in [
            ("\n1 rate a 0", "line 2: "),
            ("x rate a 5", "\"x\" is not a time: expected seconds"),
            ("rate a 5", "\"rate\" is not a time"),
            (
                "1 rate",
                "is not a timed knob: expected seconds, knob and value",
            ),
            ("1 lag a 5", "\"lag\" is not a knob: expected "),
        ] {
            let error = KnobText::default().parse_list(list).expect_err(list);
            assert!(error.to_string().contains(expected), "{list}: {error}");
        }
        let timed = KnobText::default()
            .parse("2.5 rate a 5")
            .expect_err("a time");
        assert_eq!(timed, KnobTextError::HasTime("2.5".to_owned()));
    }
}
