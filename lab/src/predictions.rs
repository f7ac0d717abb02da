//! A learner's predictions: where they are kept, and how they read.

use std::{
    env,
    path::{Path, PathBuf},
};

use directories::ProjectDirs;
use exercises::framework::{Answers, Brief};

/// Name of the file.
const FILE: &str = "answers.toml";

/// Folder of the exercises in a clone.
const FOLDER: &str = "exercises";

/// What tells that folder from others of its name.
const MARK: &str = "bands.toml";

/// The file at `named`, or else the one of the clone that we are in, or else the
/// one of this user, or else one right here.
pub fn answers_file(named: Option<&Path>) -> PathBuf {
    let named = named.map(Path::to_owned);
    let file = named.or_else(in_the_clone).or_else(of_the_user);
    file.unwrap_or_else(|| PathBuf::from(FILE))
}

fn in_the_clone() -> Option<PathBuf> {
    let here = env::current_dir().ok()?;
    let mut folders = here.ancestors().map(|folder| folder.join(FOLDER));
    let folder = folders.find(|folder| folder.join(MARK).exists())?;
    Some(folder.join(FILE))
}

/// Such as `~/.local/share/ratelab/answers.toml`; none for somebody who has no
/// home.
fn of_the_user() -> Option<PathBuf> {
    let folders = ProjectDirs::from("", "", "ratelab")?;
    Some(folders.data_dir().join(FILE))
}

/// What was predicted in an exercise, in words, if it was.
pub fn predicted(answers: &Answers, brief: &Brief) -> Option<String> {
    let prediction = answers.get(brief)?;
    let number = brief.in_unit(prediction.number());
    Some(format!("you predicted {number}"))
}
