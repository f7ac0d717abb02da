//! Graph files as programs.

use std::{path::Path, slice, sync::Arc};

use ratelab_recording::with_durations;
use ratelab_study::{
    file,
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
    let wrong = |GraphFileError { line, column, what }| {
        Error::BadInput(format!("{name}:{line}:{column}: {what}"))
    };
    let text = file::read_text(path, MOST_BYTES as u64).map_err(refused)?;
    let graph = GraphFile::parse(&text).map_err(wrong)?;
    let graph = graph.map_settings(with_durations).map_err(refused)?;
    let system = graph.system(slice::from_ref(&program.system));
    let system = system.map_err(wrong)?;
    Ok(Program {
        system: Arc::new(system),
        course: false,
    })
}
