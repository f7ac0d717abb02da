//! Graph files as programs.

use std::{path::Path, sync::Arc};

use ratelab_recording::with_durations;
use ratelab_system::{
    file,
    graph_file::{GraphFile, GraphFileError, MOST_BYTES, changed},
};

use crate::{error::Error, output::note, plants, program::Program};

/// Returns `program` with the system of the graph file at `path`, changed by `with`, which may have
/// its own system in the middle.
///
/// # Errors
/// [`Error::BadInput`] for an unreadable file or an error in it.
pub fn open(program: &Program, path: &Path, with: &[String]) -> Result<Program, Error> {
    let text = file::read_text(path, MOST_BYTES as u64);
    let name = path.display().to_string();
    let graph = text.map_err(|why| Error::BadInput(format!("{name}: {why}")))?;
    let program = Program {
        folder: path.parent().unwrap_or(Path::new("")).to_owned(),
        ..program.clone()
    };
    let (program, left_out) = program.with_graph_text(&name, graph, with)?;
    if !left_out.is_empty() {
        let keys = left_out.join(", ");
        note(&format!(
            "--with {} leaves out {keys}, which such a node cannot have",
            with.join("; ")
        ));
    }
    Ok(program)
}

impl Program {
    /// This program with its graph file changed by `with`.
    ///
    /// # Errors
    /// [`Error::BadInput`] if it has none, or not such a one.
    pub fn with(&self, with: &[String]) -> Result<Self, Error> {
        let text = self.system.about().graph_file.filter(|_| !with.is_empty());
        match text {
            Some(text) => Ok(self.with_graph_text("--with", text.to_owned(), with)?.0),
            None => Ok(self.clone()),
        }
    }

    /// Returns the program with the graph of `text`, from the file called `name`, changed by
    /// `with`, and the keys that this left out.
    fn with_graph_text(
        &self,
        name: &str,
        mut text: String,
        with: &[String],
    ) -> Result<(Self, Vec<String>), Error> {
        let mut left_out = Vec::new();
        for change in with {
            let changed =
                changed(&text, change).map_err(|why| Error::BadInput(format!("--with {why}")))?;
            text = changed.text;
            left_out.extend(changed.left_out);
        }
        let wrong = |GraphFileError { line, column, what }| match with {
            [] => Error::BadInput(format!("{name}:{line}:{column}: {what}")),
            with => Error::BadInput(format!("{name} --with {:?}: {what}", with.join("; "))),
        };
        let graph = GraphFile::parse(&text)
            .map_err(wrong)?
            .map_settings(with_durations)
            .map_err(wrong)?;
        let known = plants::known(&graph, &self.folder, &self.built_in).map_err(wrong)?;
        let system = graph.system(&known).map_err(wrong)?;
        system.check_settings().map_err(wrong)?;
        let program = Self {
            system: Arc::new(system),
            course: false,
            built_in: self.built_in.clone(),
            file: with.is_empty().then(|| name.to_owned()),
            folder: self.folder.clone(),
        };
        Ok((program, left_out))
    }
}
