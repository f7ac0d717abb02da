//! Texts with their places in a graph file, the names that it may give and use, and errors there.

use std::collections::HashSet;

use ratelab::alternatives;
use thiserror::Error;

use super::{GraphFile, NodeSpec};
use crate::CHAINS;

/// A text with its place in the file.
#[derive(Clone, Debug)]
pub(super) struct Placed {
    pub(super) text: String,
    pub(super) at: usize,
}

impl Placed {
    pub(super) fn new(text: &str, at: usize) -> Self {
        let text = text.to_owned();
        Self { text, at }
    }

    /// Returns whether it names a topic and no node.
    pub(super) fn is_topic(&self) -> bool {
        self.text.starts_with('/')
    }
}

/// Returns whether `list` has the text `text`.
pub(super) fn holds(list: &[Placed], text: &str) -> bool {
    list.iter().any(|known| known.text == text)
}

/// An error in a graph file, with its place.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("line {line}, column {column}: {what}")]
pub struct GraphFileError {
    /// Line, counted from one.
    pub line: usize,
    /// Column (characters), counted from one.
    pub column: usize,
    /// The error, with the accepted values.
    pub what: String,
}

/// The reason why the text is refused from one of its bytes on.
#[derive(Debug)]
pub(super) struct GraphRefusal {
    at: usize,
    what: String,
}

/// A part of a file that is as it should be.
pub(super) type Checked<T = ()> = Result<T, GraphRefusal>;

impl GraphRefusal {
    pub(super) fn new(at: usize, what: impl Into<String>) -> Self {
        let what = what.into();
        Self { at, what }
    }

    /// Returns the error in `text`, with line and column.
    pub(super) fn in_text(self, text: &str) -> GraphFileError {
        let [line, column] = line_and_column(text, self.at);
        let what = self.what;
        GraphFileError { line, column, what }
    }
}

/// Line and column of the byte `at` in `text`, counted from one.
pub(super) fn line_and_column(text: &str, at: usize) -> [usize; 2] {
    let before = text.get(..at).unwrap_or(text);
    let line = before.rsplit('\n').next().unwrap_or_default();
    [1 + before.matches('\n').count(), 1 + line.chars().count()]
}

pub(super) fn refuse<T>(at: usize, what: impl Into<String>) -> Checked<T> {
    Err(GraphRefusal::new(at, what))
}

/// Refuses `name`, which is none of the `known` names; the error begins with `what`.
pub(super) fn unknown<'n, T>(
    what: &str,
    name: &Placed,
    known: impl Iterator<Item = &'n str>,
) -> Checked<T> {
    let instead = instead(&name.text, known);
    refuse(name.at, format!("{what} {:?}: {instead}", name.text))
}

/// Returns the word of `known` that is most like `word`, if one is; all of them otherwise.
pub(super) fn instead<'k>(word: &str, known: impl IntoIterator<Item = &'k str>) -> String {
    let mut names = HashSet::new();
    let known: Vec<&str> = known
        .into_iter()
        .filter(|name| names.insert(*name))
        .collect();
    let likeness = |other: &&&str| strsim::jaro_winkler(word, other);
    let nearest = known
        .iter()
        .max_by(|a, b| likeness(a).total_cmp(&likeness(b)));
    match nearest.filter(|nearest| likeness(nearest) > 0.7) {
        Some(nearest) => format!("did you mean {nearest:?}?"),
        None if known.is_empty() => "there are none".to_owned(),
        None => format!("expected {}", listed(&known)),
    }
}

/// The most names in an error.
const LISTED: usize = 12;

/// Returns the names as a list.
fn listed(names: &[&str]) -> String {
    let (shown, rest) = names.split_at(names.len().min(LISTED));
    match rest {
        [] => alternatives(shown),
        _ => format!("one of {}, ...", shown.join(", ")),
    }
}

/// The longest name (characters).
const LONGEST_NAME: usize = 64;

/// Returns the node called `name`; `None` if it may be one of the system in the middle, which is
/// checked when that is known.
pub(super) fn node_of<'f>(file: &'f GraphFile, name: &Placed) -> Checked<Option<&'f NodeSpec>> {
    match file.node(&name.text) {
        None if file.inner.is_none() => unknown("no node", name, file.names()),
        known => Ok(known),
    }
}

/// Refuses a name that would be ambiguous in knobs, options and recordings.
pub(super) fn name(name: &Placed) -> Checked {
    let plain = |c: char| c.is_alphanumeric() || "_-.".contains(c);
    let fits = name.text.chars().all(plain)
        && name.text.starts_with(|c: char| c.is_alphanumeric())
        && name.text.chars().count() <= LONGEST_NAME;
    let expected = "expected letters, digits, _, - and ., beginning with a letter or a digit";
    if fits {
        Ok(())
    } else {
        refuse(name.at, format!("{:?} is no name: {expected}", name.text))
    }
}

/// Refuses a name that is none of a topic.
pub(super) fn topic_name(name: &Placed) -> Checked {
    let parts = name.text.strip_prefix('/').map(|rest| rest.split('/'));
    let plain = |c: char| c.is_alphanumeric() || "_-".contains(c);
    let fits = name.text.chars().count() <= LONGEST_NAME
        && parts
            .is_some_and(|mut parts| parts.all(|part| !part.is_empty() && part.chars().all(plain)));
    if name.text == CHAINS {
        let what = format!("{CHAINS} has the data ages: choose another name");
        return refuse(name.at, what);
    }
    let expected = "expected a slash, then letters, digits, _ and -, such as \"/image\"";
    if fits {
        Ok(())
    } else {
        refuse(name.at, format!("{:?} is no topic: {expected}", name.text))
    }
}

/// Refuses a name in a list that has it `before`.
pub(super) fn once(key: &str, name: &Placed, before: &[Placed]) -> Checked {
    if holds(before, &name.text) {
        let what = format!("{key}: {:?} is there twice: leave one out", name.text);
        return refuse(name.at, what);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_a_line_and_a_column_of_characters() {
        let text = "name = \"ä\"\nrate = 5\n";
        for (at, place) in [
            (0, [1, 1]),
            (8, [1, 9]),
            (10, [1, 10]),
            (12, [2, 1]),
            (99, [3, 1]),
        ] {
            assert_eq!(line_and_column(text, at), place, "{at}");
        }
    }

    #[test]
    fn the_nearest_name_is_offered_and_otherwise_some_of_all() {
        let many: Vec<String> = (0..20).map(|number| format!("x{number}")).collect();
        let many: Vec<&str> = many.iter().map(String::as_str).collect();
        for (word, known, expected) in [
            (
                "camra",
                &["camera", "control"][..],
                "did you mean \"camera\"?",
            ),
            ("zz", &["camera", "control"], "expected camera or control"),
            ("zz", &["camera", "camera"], "expected camera"),
            ("zz", &[], "there are none"),
            (
                "zz",
                &many,
                "expected one of x0, x1, x2, x3, x4, x5, x6, x7, x8, x9, x10, x11, ...",
            ),
        ] {
            assert_eq!(instead(word, known.iter().copied()), expected, "{word}");
        }
    }

    #[test]
    fn names_are_plain_so_that_they_are_whole_in_knobs_and_options() {
        let long = "x".repeat(LONGEST_NAME + 1);
        for (text, of_node, of_topic) in [
            ("camera", true, false),
            ("left.eye-2", true, false),
            ("_x", false, false),
            ("two words", false, false),
            ("", false, false),
            (&*long, false, false),
            ("/image", false, true),
            ("/left/image", false, true),
            ("/left//image", false, false),
            ("/", false, false),
            (CHAINS, false, false),
        ] {
            let placed = Placed::new(text, 7);
            assert_eq!(name(&placed).is_ok(), of_node, "{text}");
            assert_eq!(topic_name(&placed).is_ok(), of_topic, "{text}");
        }
    }
}
