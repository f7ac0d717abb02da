//! The predictions that a learner made, kept in a file.

use std::{
    collections::BTreeMap,
    fs, io,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::{Brief, Prediction};

/// Predictions by exercise. In the file each is a table of its exercise's name,
/// with a `number` and a `reason`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Answers(BTreeMap<String, Prediction>);

impl Answers {
    /// The predictions in the file at `path`; none if there is no file.
    ///
    /// # Errors
    /// [`AnswersError`] if the file cannot be read or is not one of answers.
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

    /// Tries whether predictions can be saved to the file at `path`, which stays as
    /// it is. Folders that it needs are made.
    ///
    /// # Errors
    /// [`AnswersError`] if they cannot.
    pub fn try_place(path: &Path) -> Result<(), AnswersError> {
        let new = beside(path);
        write(&new, "")
            .and_then(|()| fs::remove_file(&new))
            .map_err(|error| AnswersError::unusable(path, error))
    }

    /// Writes the predictions to the file at `path`, all of them or, if that
    /// fails, none. Folders that it needs are made.
    ///
    /// # Errors
    /// [`AnswersError`] if the file cannot be written.
    pub fn save(&self, path: &Path) -> Result<(), AnswersError> {
        let text = toml::to_string(self).map_err(|error| AnswersError::unusable(path, error))?;
        let new = beside(path);
        write(&new, &text)
            .and_then(|()| fs::rename(&new, path))
            .map_err(|error| {
                // Whether it is there or not, the failure to write is what counts.
                let _ = fs::remove_file(&new);
                AnswersError::unusable(path, error)
            })
    }

    /// What was predicted in this exercise, if it was.
    pub fn get(&self, exercise: &Brief) -> Option<&Prediction> {
        self.0.get(exercise.name)
    }

    /// Sets what is predicted in this exercise.
    pub fn set(&mut self, exercise: &Brief, prediction: Prediction) {
        self.0.insert(exercise.name.to_owned(), prediction);
    }

    /// Forgets what was predicted in this exercise.
    pub fn clear(&mut self, exercise: &Brief) {
        self.0.remove(exercise.name);
    }
}

/// Where answers are written before they take the place of the file at `path`.
fn beside(path: &Path) -> PathBuf {
    path.with_extension("toml.new")
}

/// Writes a file and makes the folders that it needs.
fn write(file: &Path, text: &str) -> io::Result<()> {
    file.parent().map_or(Ok(()), fs::create_dir_all)?;
    fs::write(file, text)
}

/// What is wrong with `text`, and in which line.
fn in_a_line(text: &str, error: &toml::de::Error) -> String {
    let before = error.span().and_then(|span| text.get(..span.start));
    let line = before.map_or(1, |before| before.matches('\n').count() + 1);
    format!("line {line}: {}", error.message().replace('\n', " "))
}

/// A file of answers that cannot be used.
#[derive(Debug, Error)]
pub enum AnswersError {
    /// What is in it are no answers.
    #[error("{path}: {cause}; mend the file, or remove it to begin anew")]
    Content {
        /// The file.
        path: String,
        /// What is wrong, and in which line.
        cause: String,
    },
    /// It cannot be read or written.
    #[error("predictions are kept in {path}: {cause}; --answers FILE keeps them elsewhere")]
    Unusable {
        /// The file.
        path: String,
        /// What the system said.
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
