//! The files of a class: hand-ins in their natural order, and the roster.

use std::{
    cmp::Ordering,
    collections::BTreeMap,
    fmt::Display,
    fs, io,
    path::{Path, PathBuf},
};

use exercises::framework::Answers;
use ratelab_system::file::read_text;
use thiserror::Error as ThisError;

use super::file_name;
use crate::{error::Error, predictions};

/// What a learner handed in.
pub struct HandIn {
    /// Name of the folder.
    pub learner: String,
    /// The predictions; none without a file.
    pub answers: Answers,
    /// The recordings, by name.
    pub recordings: Vec<PathBuf>,
    /// Why it is not acceptable, if it is not.
    pub refused: Option<String>,
}

/// Returns the hand-ins in `dir`, by name. Hidden folders and loose files are none.
pub fn hand_ins(dir: &Path) -> Result<Vec<HandIn>, Error> {
    let bad = |why: io::Error| Error::BadInput(format!("{}: {why}", dir.display()));
    let hand_ins: Vec<HandIn> = sorted(dir)
        .map_err(bad)?
        .into_iter()
        .filter(|path| path.is_dir() && !file_name(path).starts_with('.'))
        .map(|folder| HandIn::read(&folder))
        .collect();
    if hand_ins.is_empty() {
        let why = "there is no hand-in: expected one folder per learner, with answers.toml in it";
        return Err(Error::BadInput(format!("{}: {why}", dir.display())));
    }
    Ok(hand_ins)
}

impl HandIn {
    fn read(folder: &Path) -> Self {
        let (mut recordings, listed) = match sorted(folder) {
            Ok(files) => (files, None),
            Err(why) => (Vec::new(), Some(why.to_string())),
        };
        let (answers, invalid) = match Answers::load(&folder.join(predictions::FILE)) {
            Ok(answers) => (answers, None),
            Err(error) => {
                let why = format!("{}: {}", predictions::FILE, error.cause());
                (Answers::default(), Some(why))
            }
        };
        recordings.retain(|path| path.extension().is_some_and(|end| end == "rrd"));
        let empty = answers == Answers::default() && recordings.is_empty();
        let nothing = || "nothing is handed in: neither predictions nor a recording".to_owned();
        Self {
            learner: file_name(folder),
            answers,
            recordings,
            refused: listed.or(invalid).or_else(|| empty.then(nothing)),
        }
    }
}

/// Returns the content of a folder, by name: s2 comes before s10.
fn sorted(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let entries = fs::read_dir(folder)?.map(|entry| entry.map(|entry| entry.path()));
    let mut paths = entries.collect::<io::Result<Vec<PathBuf>>>()?;
    paths.sort_by(|one, other| order(&file_name(one), &file_name(other)));
    Ok(paths)
}

/// Compares numbers in names by their size, and everything else by letter.
pub fn order(one: &str, other: &str) -> Ordering {
    let (mut left, mut right) = (one, other);
    while !left.is_empty() && !right.is_empty() {
        let [a, b] = [digits(left), digits(right)];
        let order = if a.is_empty() || b.is_empty() {
            let (a, b) = (left.chars().next(), right.chars().next());
            left = &left[a.map_or(0, char::len_utf8)..];
            right = &right[b.map_or(0, char::len_utf8)..];
            a.cmp(&b)
        } else {
            (left, right) = (&left[a.len()..], &right[b.len()..]);
            let [a, b] = [a, b].map(|digits| digits.trim_start_matches('0'));
            a.len().cmp(&b.len()).then_with(|| a.cmp(b))
        };
        if order != Ordering::Equal {
            return order;
        }
    }
    // Names that differ in leading zeros only are never equal.
    left.len().cmp(&right.len()).then_with(|| one.cmp(other))
}

/// Returns the digits at the start.
fn digits(text: &str) -> &str {
    let end = text.find(|c: char| !c.is_ascii_digit());
    &text[..end.unwrap_or(text.len())]
}

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
    fn names_with_numbers_are_in_the_order_of_the_numbers() {
        let sorted = "1 02 2 10 10b anna s s1 s01x s2 s9-2 s9-10 s10 \
                  s99999999999999999999999 s100000000000000000000000 é1 é10";
        let sorted: Vec<&str> = sorted.split(' ').collect();
        let mut names = sorted.clone();
        names.reverse();
        names.sort_by(|a, b| order(a, b));
        assert_eq!(names, sorted);
    }

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
