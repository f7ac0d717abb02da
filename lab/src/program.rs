//! The system and the name of a command.

use std::{
    env,
    path::{Path, PathBuf},
    sync::Arc,
};

use ratelab_system::{KnobText, System};

use ratelab_recording::Recording;

use crate::plants;

/// The command for one system.
#[derive(Clone)]
pub struct Program {
    /// The system.
    pub system: Arc<dyn System>,
    /// Whether it includes the course of the cart-pole.
    pub course: bool,
    /// The system without a graph file: that in the middle of one.
    pub built_in: Arc<dyn System>,
    /// The name of the graph file, as it is on the disk.
    pub file: Option<String>,
    /// The folder of the graph file: models lie there or below.
    pub folder: PathBuf,
}

impl Program {
    /// Creates the program for a system of its own; that of the `course`, or another one.
    pub fn new(system: Arc<dyn System>, course: bool) -> Self {
        Self {
            built_in: system.clone(),
            system,
            course,
            file: None,
            folder: PathBuf::new(),
        }
    }

    /// Returns the program for `recording`: of another system if that has a graph file.
    pub fn for_recording(&self, recording: &Recording) -> Self {
        let graph = recording.graph_system(&plants::recorded(recording, &self.built_in));
        Self {
            course: self.course && graph.is_none(),
            built_in: self.built_in.clone(),
            file: None,
            folder: self.folder.clone(),
            system: graph.unwrap_or_else(|| self.system.clone()),
        }
    }

    /// Parses and writes knobs with the system's aliases.
    pub fn knobs(&self) -> KnobText {
        KnobText(self.system.knobs().aliases())
    }
}

/// Returns the program's name on the command line.
pub fn name() -> String {
    let called = env::args_os().next().unwrap_or_default();
    let name = Path::new(&called)
        .file_stem()
        .and_then(|name| name.to_str());
    name.unwrap_or("ratelab").to_owned()
}
