//! A learner's predictions, kept in a file.

use std::{
    collections::BTreeMap,
    fs, io,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::{Brief, Prediction, PredictionOrigin, entry::PredictionEntry};

/// Predictions by exercise. In the file each is a table with the exercise's name, a
/// `number` and a `reason`; where it was made again, the first one is a table in it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Answers(BTreeMap<String, PredictionEntry>);

impl Answers {
    /// Loads the predictions in the file at `path`; none if there is no file.
    ///
    /// # Errors
    /// [`AnswersError`] if the file is unreadable or invalid.
    pub fn load(path: &Path) -> Result<Self, AnswersError> {
        let text = match fs::read_to_string(path) {
            Ok(text) => text,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Self::default()),
            Err(error) => return Err(AnswersError::unusable(path, error)),
        };
        toml::from_str(&text).map_err(|error| AnswersError::Content {
            path: path.display().to_string(),
            cause: in_a_line(&text, &error),
        })
    }

    /// Checks that predictions can be saved to the file at `path`, without changing it.
    /// Creates missing folders.
    ///
    /// # Errors
    /// [`AnswersError`] if they cannot be saved.
    pub fn try_place(path: &Path) -> Result<(), AnswersError> {
        let new = beside(path);
        write(&new, "")
            .and_then(|()| fs::remove_file(&new))
            .map_err(|error| AnswersError::unusable(path, error))
    }

    /// Writes all predictions to the file at `path`, or none on failure. Creates missing
    /// folders.
    ///
    /// # Errors
    /// [`AnswersError`] if the file cannot be written.
    pub fn save(&self, path: &Path) -> Result<(), AnswersError> {
        let text = toml::to_string(self).map_err(|error| AnswersError::unusable(path, error))?;
        let new = beside(path);
        write(&new, &text)
            .and_then(|()| fs::rename(&new, path))
            .map_err(|error| {
                // The error of the write matters, so any other is ignored.
                let _ = fs::remove_file(&new);
                AnswersError::unusable(path, error)
            })
    }

    /// The prediction for this exercise, if there is one and it is not asked for again.
    pub fn get(&self, exercise: &Brief) -> Option<&Prediction> {
        let entry = self.0.get(&exercise.name).filter(|entry| !entry.open)?;
        Some(&entry.prediction)
    }

    /// The first prediction for this exercise: the only one that was made without the
    /// measurement.
    pub fn first(&self, exercise: &Brief) -> Option<&Prediction> {
        self.0.get(&exercise.name).map(PredictionEntry::first)
    }

    /// The latest prediction for this exercise, where there was an earlier one.
    pub fn redone(&self, exercise: &Brief) -> Option<&Prediction> {
        let entry = self.0.get(&exercise.name);
        let again = entry.filter(|entry| entry.is_redone())?;
        Some(&again.prediction)
    }

    /// The prediction for this exercise as text, if there is one.
    pub fn predicted(&self, exercise: &Brief) -> Option<String> {
        let number = exercise.in_unit(self.get(exercise)?.number());
        let first = self.redone(exercise).and_then(|_| self.first(exercise));
        let first = first.map(|first| format!(", first {}", exercise.in_unit(first.number())));
        Some(format!(
            "you predicted {number}{}",
            first.unwrap_or_default()
        ))
    }

    /// How the predictions for this exercise came into the file.
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

/// Path of the new file, before it replaces the file at `path`.
fn beside(path: &Path) -> PathBuf {
    path.with_extension("toml.new")
}

/// Writes a file and creates missing folders.
fn write(file: &Path, text: &str) -> io::Result<()> {
    file.parent().map_or(Ok(()), fs::create_dir_all)?;
    fs::write(file, text)
}

/// The error in `text`, with its line.
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
    /// Reading or writing failed.
    #[error("predictions are kept in {path}: {cause}; --answers FILE keeps them elsewhere")]
    Unusable {
        /// Path of the file.
        path: String,
        /// The error of the operating system.
        cause: Box<dyn std::error::Error + Send + Sync>,
    },
}

impl AnswersError {
    fn unusable(path: &Path, cause: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> Self {
        Self::Unusable {
            path: path.display().to_string(),
            cause: cause.into(),
        }
    }
}
