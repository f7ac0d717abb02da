//! The files of the learners.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use exercises::framework::Answers;

use super::{file_name, natural};
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
    let folders = sorted(dir)
        .map_err(bad)?
        .into_iter()
        .filter(|path| path.is_dir() && !file_name(path).starts_with('.'));
    let hand_ins: Vec<HandIn> = folders.map(|folder| HandIn::read(&folder)).collect();
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
    paths.sort_by(|one, other| natural::order(&file_name(one), &file_name(other)));
    Ok(paths)
}
