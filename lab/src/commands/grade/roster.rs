//! The roster of a class: who has which number.

use std::{collections::BTreeMap, fmt::Display, path::Path};

use ratelab_system::file::read_text;
use thiserror::Error as ThisError;

use crate::error::Error;

/// Maximum size of a roster (bytes).
const LARGEST: u64 = 1 << 20;

/// What is wrong with a roster.
#[derive(Debug, ThisError)]
enum RosterError {
    #[error("line {line}: {name:?} is there twice")]
    Twice { line: usize, name: String },
    #[error("line {line}: {text:?}: expected a learner and a number, as in anna,17")]
    NoLearner { line: usize, text: String },
    #[error("there is no learner in it: expected lines such as anna,17")]
    Empty,
}

/// Numbers by the name of the learner's folder.
pub struct Roster(BTreeMap<String, u64>);

impl Roster {
    /// Reads a file with a learner per line, such as `anna,17`. A first line without a
    /// number is a head; `#` begins a comment.
    ///
    /// # Errors
    /// [`Error::BadInput`] for an unreadable file, and for a line without a learner.
    pub fn read(file: &Path) -> Result<Self, Error> {
        let bad =
            |why: &dyn Display| Error::BadInput(format!("--roster {}: {why}", file.display()));
        let text = read_text(file, LARGEST).map_err(|why| bad(&why))?;
        Self::parse(&text).map_err(|why| bad(&why))
    }

    fn parse(text: &str) -> Result<Self, RosterError> {
        let mut numbers = BTreeMap::new();
        let lines = text.trim_start_matches('\u{feff}').lines();
        for (number, line) in (1..).zip(lines) {
            let entry = line.split('#').next().unwrap_or_default().trim();
            if entry.is_empty() {
                continue;
            }
            match learner(entry) {
                Some((name, _)) if numbers.contains_key(&name) => {
                    return Err(RosterError::Twice { line: number, name });
                }
                Some((name, of)) => drop(numbers.insert(name, of)),
                None if number == 1 && entry.contains(SEPARATORS) => {}
                None => {
                    return Err(RosterError::NoLearner {
                        line: number,
                        text: entry.to_owned(),
                    });
                }
            }
        }
        if numbers.is_empty() {
            Err(RosterError::Empty)
        } else {
            Ok(Self(numbers))
        }
    }

    /// Returns the number of a learner.
    pub fn number(&self, learner: &str) -> Option<u64> {
        self.0.get(learner).copied()
    }

    /// Returns the learners with this number.
    pub fn owners(&self, number: u64) -> impl Iterator<Item = &str> {
        let all = self.0.iter().filter(move |(_, known)| **known == number);
        all.map(|(name, _)| name.as_str())
    }

    /// Returns all learners.
    pub fn learners(&self) -> impl ExactSizeIterator<Item = &str> {
        self.0.keys().map(String::as_str)
    }
}

/// What stands between a name and a number.
const SEPARATORS: [char; 4] = [',', ';', '\t', ' '];

fn learner(line: &str) -> Option<(String, u64)> {
    let (name, number) = line.rsplit_once(SEPARATORS)?;
    let quotes: &[char] = &['"', '\''];
    let name = name.trim_end_matches(SEPARATORS).trim_matches(quotes);
    let number = number.trim_matches(quotes).parse().ok()?;
    (!name.is_empty()).then(|| (name.to_owned(), number))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_roster_has_a_learner_and_a_number_per_line() {
        for text in [
            "anna,17\nbert b,3\n",
            "name,number\r\nanna,17\r\nbert b,3\r\n",
            "# seats\n\nanna 17 # window\n\"bert b\"; 3",
            "\u{feff}anna\t17\nbert b\t3",
        ] {
            let roster = Roster::parse(text).expect(text);
            assert_eq!(roster.number("anna"), Some(17), "{text}");
            assert_eq!(roster.number("bert b"), Some(3), "{text}");
            assert_eq!(roster.number("carl"), None);
            assert_eq!(roster.owners(3).collect::<Vec<_>>(), ["bert b"]);
            assert_eq!(roster.learners().len(), 2);
        }
    }

    #[test]
    fn a_roster_that_is_none_is_refused_with_its_line() {
        for (text, said) in [
            ("", "no learner"),
            ("name,number", "no learner"),
            ("anna,17\nbert", "line 2: \"bert\": expected"),
            ("anna,17\nbert,-1", "line 2"),
            ("anna,17\nbert,1.5", "line 2"),
            ("anna,17\nanna,18", "line 2: \"anna\" is there twice"),
            ("anna", "line 1"),
            (",17", "no learner"),
        ] {
            let refused = Roster::parse(text).err().expect(text).to_string();
            assert!(refused.contains(said), "{text:?}: {refused}");
        }
    }
}
