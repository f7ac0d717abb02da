//! A learner's predictions, kept in a file: its entries, and the marks in them.

use std::{
    collections::BTreeMap,
    hash::{BuildHasher, Hasher, RandomState},
    io,
    path::Path,
};

use ratelab::Digest;
use ratelab_system::file::{LockedFile, TextError, read_text_if_there};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::{
    Brief, Findings,
    prediction::{Prediction, PredictionError},
};

/// Maximum size of a file of predictions (bytes).
const LARGEST: u64 = 1 << 20;

/// Predictions by exercise. In the file each is a table with the exercise's name, a
/// `number` and a `reason`, and says whether it is `right`; where it was made again, the first one
/// is a table in it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Answers(BTreeMap<String, PredictionEntry>);

impl Answers {
    /// Loads the predictions in the file at `path`; none without a file.
    ///
    /// # Errors
    /// [`AnswersError`] if the file is unreadable or invalid.
    pub fn load(path: &Path) -> Result<Self, AnswersError> {
        let text = read_text_if_there(path, LARGEST);
        Self::parse(path, text.map_err(AnswersError::unusable(path))?)
    }

    fn parse(path: &Path, text: Option<String>) -> Result<Self, AnswersError> {
        let Some(text) = text else {
            return Ok(Self::default());
        };
        toml::from_str(&text).map_err(|error| AnswersError::Content {
            path: path.display().to_string(),
            cause: in_a_line(&text, &error),
        })
    }

    /// Checks that predictions can be kept in the file at `path`, without changing it.
    /// Creates missing folders.
    ///
    /// # Errors
    /// [`AnswersError`] if they cannot be kept there.
    pub fn try_place(path: &Path) -> Result<(), AnswersError> {
        let place = LockedFile::lock(path, LARGEST);
        place.map(drop).map_err(AnswersError::unusable(path))
    }

    /// Changes the predictions in the file at `path`, which nobody else changes meanwhile, and
    /// returns them. Creates missing folders.
    ///
    /// # Errors
    /// [`AnswersError`] if they cannot be read or written; the file is then as it was.
    pub fn change(path: &Path, change: impl FnOnce(&mut Self)) -> Result<Self, AnswersError> {
        let mut file = LockedFile::lock(path, LARGEST).map_err(AnswersError::unusable(path))?;
        let mut answers = Self::parse(path, file.text.take())?;
        change(&mut answers);
        let text = toml::to_string(&answers).map_err(io::Error::other);
        text.and_then(|text| file.replace(&text))
            .map_err(|cause| AnswersError::Unwritten {
                path: path.display().to_string(),
                cause,
            })?;
        Ok(answers)
    }

    /// Returns the prediction for this exercise, unless it is missing or asked for again.
    pub fn get(&self, exercise: &Brief) -> Option<&Prediction> {
        let entry = self.0.get(&exercise.name).filter(|entry| !entry.open)?;
        Some(&entry.prediction)
    }

    /// Returns the first prediction for this exercise: the only one that was made without the
    /// measurement.
    pub fn first(&self, exercise: &Brief) -> Option<&Prediction> {
        let entry = self.0.get(&exercise.name)?;
        Some(&entry.first().prediction)
    }

    /// Returns the latest prediction for this exercise, where there was an earlier one.
    pub fn redone(&self, exercise: &Brief) -> Option<&Prediction> {
        let entry = self.0.get(&exercise.name);
        let again = entry.filter(|entry| entry.is_redone())?;
        Some(&again.prediction)
    }

    /// Notes in the file at `path` whether the first prediction for this exercise is right, by the
    /// `findings` for the learner's number `seed`, unless that is known; the predictions are then
    /// read from the file.
    ///
    /// # Errors
    /// As of [`change`](Self::change); nothing is noted then.
    pub fn judge(
        &mut self,
        path: &Path,
        exercise: &Brief,
        findings: &Findings,
        seed: u64,
    ) -> Result<(), AnswersError> {
        let judgement = |answers: &Self| answers.judgement(exercise, findings, seed);
        if judgement(self).is_some() {
            *self = Self::change(path, |answers| {
                let is_right = judgement(answers);
                let entry = answers.0.get_mut(&exercise.name);
                if let (Some(entry), Some(is_right)) = (entry, is_right) {
                    entry.judge(is_right);
                }
            })?;
        }
        Ok(())
    }

    /// Returns whether the first prediction for this exercise is right; `None` if that is known, or
    /// the `findings` are for another number than its own.
    fn judgement(&self, exercise: &Brief, findings: &Findings, seed: u64) -> Option<bool> {
        let first = self.0.get(&exercise.name)?.first();
        let (is_right, _) = findings.judge(exercise, &first.prediction);
        let is_new = first.prediction.seed() == seed && first.right != Some(is_right);
        is_new.then_some(is_right)
    }

    /// Returns the prediction for this exercise as text, if any, with whether the first one was
    /// right.
    pub fn predicted(&self, exercise: &Brief) -> Option<String> {
        let judged = self.0.get(&exercise.name)?.first().right;
        let sign = match judged {
            Some(true) => "✓ ",
            Some(false) => "✖ ",
            None => "",
        };
        let number = exercise.in_unit(self.get(exercise)?.number());
        let first = self
            .redone(exercise)
            .and_then(|_| self.first(exercise))
            .map(|first| format!(", first {}", exercise.in_unit(first.number())));
        Some(format!(
            "{sign}you predicted {number}{}",
            first.unwrap_or_default()
        ))
    }

    /// Returns how the predictions for this exercise came into the file.
    pub fn origin(&self, exercise: &Brief) -> Option<PredictionOrigin> {
        let entry = self.0.get(&exercise.name)?;
        Some(entry.origin(&exercise.name))
    }

    /// Sets the prediction for this exercise, and keeps the first one.
    pub fn set(&mut self, exercise: &Brief, prediction: Prediction) {
        let name = &exercise.name;
        let entry = PredictionEntry::new(name, prediction, self.0.remove(name));
        self.0.insert(name.clone(), entry);
    }

    /// Asks for the prediction for this exercise again.
    pub fn reopen(&mut self, exercise: &Brief) {
        if let Some(entry) = self.0.get_mut(&exercise.name) {
            entry.open = true;
        }
    }
}

/// Returns the error in `text`, with its line.
fn in_a_line(text: &str, error: &toml::de::Error) -> String {
    let before = error.span().and_then(|span| text.get(..span.start));
    let line = before.map_or(1, |before| before.matches('\n').count() + 1);
    format!("line {line}: {}", error.message().replace('\n', " "))
}

/// An unusable file of predictions.
#[derive(Debug, Error)]
pub enum AnswersError {
    /// Invalid content.
    #[error("{path}: {cause}; fix the file, or remove it to start again")]
    Content {
        /// Path of the file.
        path: String,
        /// The error, with its line.
        cause: String,
    },
    /// The file cannot be read, or not be written to.
    #[error("predictions are kept in {path}: {cause}; --answers FILE keeps them elsewhere")]
    Unusable {
        /// Path of the file.
        path: String,
        /// The cause.
        cause: TextError,
    },
    /// Writing failed.
    #[error("cannot write {path}: {cause}; the predictions in it are as they were")]
    Unwritten {
        /// Path of the file.
        path: String,
        /// The error of the operating system.
        cause: io::Error,
    },
}

impl AnswersError {
    /// Returns the cause, without the name of the file.
    pub fn cause(&self) -> String {
        match self {
            Self::Content { cause, .. } => cause.clone(),
            Self::Unusable { cause, .. } => cause.to_string(),
            Self::Unwritten { cause, .. } => cause.to_string(),
        }
    }

    fn unusable(path: &Path) -> impl FnOnce(TextError) -> Self {
        let path = path.display().to_string();
        |cause| Self::Unusable { path, cause }
    }
}

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
