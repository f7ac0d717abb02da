//! Graph files as programs.

use std::{path::Path, slice, sync::Arc};

use ratelab_study::{
    file::{self, FileError},
    graph_file::{GraphFile, GraphFileError, MOST_BYTES},
};

use crate::{error::Error, program::Program};

/// `program` with the system of the graph file at `path`, which may have its own system in the
/// middle.
///
/// # Errors
/// [`Error::BadInput`] for an unreadable file or an error in it.
pub fn open(program: &Program, path: &Path) -> Result<Program, Error> {
    let name = path.display();
    let refused = |why: String| Error::BadInput(format!("{name}: {why}"));
    let most = MOST_BYTES as u64;
    let content = file::read(path, most).map_err(|error| match error {
        FileError::Unreadable(why) => refused(why.to_string()),
        other => refused(format!(
            "expected a text file of {most} bytes at most, {other}"
        )),
    })?;
    let text = String::from_utf8(content);
    let text = text.map_err(|_| refused("expected a text file in UTF-8".to_owned()))?;
    let system =
        GraphFile::parse(&text).and_then(|graph| graph.system(slice::from_ref(&program.system)));
    let system = system.map_err(|GraphFileError { line, column, what }| {
        Error::BadInput(format!("{name}:{line}:{column}: {what}"))
    })?;
    Ok(Program {
        system: Arc::new(system),
        course: false,
    })
}
