//! Entries of a file of predictions, and the marks in them.

use std::hash::{BuildHasher, Hasher, RandomState};

use ratelab::Digest;
use serde::{Deserialize, Serialize};

use super::prediction::{Prediction, PredictionError};

/// How a prediction came into its file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PredictionOrigin {
    /// ratelab wrote it. No other prediction has the same mark, unless it is a copy.
    Written(String),
    /// It has no mark: an earlier version wrote it, or somebody else.
    Unmarked,
    /// It was changed after ratelab wrote it.
    Edited,
}

/// Digits of the part that is drawn, and of the check of the rest.
const DIGITS: usize = 16;

/// Returns a mark for `content` that no other one repeats.
pub(super) fn new(content: &str) -> String {
    // Each of these has keys of its own, drawn by the operating system.
    let drawn = format!("{:0DIGITS$x}", RandomState::new().build_hasher().finish());
    let check = check(&drawn, content);
    format!("{drawn}-{check}")
}

/// Returns how `content` with this `mark` came into its file.
pub(super) fn origin(mark: Option<&str>, content: &str) -> PredictionOrigin {
    let Some(mark) = mark else {
        return PredictionOrigin::Unmarked;
    };
    match mark.split_once('-') {
        Some((drawn, found)) if found == check(drawn, content) => {
            PredictionOrigin::Written(mark.to_owned())
        }
        _ => PredictionOrigin::Edited,
    }
}

fn check(drawn: &str, content: &str) -> String {
    let digest = Digest::new(format!("{drawn} {content}").as_bytes());
    digest.to_string().chars().take(DIGITS).collect()
}

/// A prediction, with the first one where it was made again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Written", into = "Written")]
pub(super) struct PredictionEntry {
    pub prediction: Prediction,
    mark: Option<String>,
    /// Whether the question is to be asked again.
    pub open: bool,
    first: Option<Box<PredictionEntry>>,
    /// Whether it is right, as far as it was measured.
    pub right: Option<bool>,
}

impl PredictionEntry {
    /// Creates the prediction for the exercise `name`, after an `earlier` one if any.
    pub fn new(name: &str, prediction: Prediction, earlier: Option<Self>) -> Self {
        let first = earlier.map(|earlier| match earlier.first {
            Some(first) => first,
            None => Box::new(Self {
                open: false,
                ..earlier
            }),
        });
        let mut entry = Self {
            prediction,
            mark: None,
            open: false,
            first,
            right: None,
        };
        entry.mark = Some(new(&entry.content(name)));
        entry
    }

    /// Returns the entry that was made first.
    pub fn first(&self) -> &Self {
        self.first.as_deref().unwrap_or(self)
    }

    /// Notes whether the first prediction is right.
    pub fn judge(&mut self, right: bool) {
        match &mut self.first {
            Some(first) => first.right = Some(right),
            None => self.right = Some(right),
        }
    }

    /// Returns whether there is an earlier one.
    pub fn is_redone(&self) -> bool {
        self.first.is_some()
    }

    /// Returns how it, and the first one, came into the file.
    pub fn origin(&self, name: &str) -> PredictionOrigin {
        let own = origin(self.mark.as_deref(), &self.content(name));
        match self.first.as_deref().map(|first| first.origin(name)) {
            Some(first) if own != PredictionOrigin::Edited => first,
            _ => own,
        }
    }

    /// Returns what the mark vouches for.
    fn content(&self, name: &str) -> String {
        let first = self.first.as_deref();
        format!(
            "{name} {} {:?} {:?} {:?}",
            self.prediction.number(),
            self.prediction.reason(),
            self.prediction.seed,
            first.map(|first| &first.mark),
        )
    }
}

/// An entry as it stands in the file.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table with a number and a reason")]
struct Written {
    number: f64,
    reason: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    seed: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    mark: Option<String>,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    open: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    right: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    first: Option<Box<PredictionEntry>>,
}

impl TryFrom<Written> for PredictionEntry {
    type Error = PredictionError;

    fn try_from(read: Written) -> Result<Self, PredictionError> {
        let mut prediction = Prediction::new(read.number, &read.reason)?;
        prediction.seed = read.seed;
        Ok(Self {
            prediction,
            mark: read.mark,
            open: read.open,
            first: read.first,
            right: read.right,
        })
    }
}

impl From<PredictionEntry> for Written {
    fn from(entry: PredictionEntry) -> Self {
        Self {
            number: entry.prediction.number(),
            reason: entry.prediction.reason().to_owned(),
            seed: entry.prediction.seed,
            mark: entry.mark,
            open: entry.open,
            right: entry.right,
            first: entry.first,
        }
    }
}
