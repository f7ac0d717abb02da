//! The program: its system, its name, its version, its command lines; and the robots of graph
//! files, loaded from their models or from recordings.

use std::{
    env,
    path::{Path, PathBuf},
    sync::Arc,
};

use ratelab_cart_pole::{mujoco_version, policy::RUNS_ONNX};
use ratelab_plant::RobotPlant;
use ratelab_recording::{Recording, rrd::rerun_version};
use ratelab_system::{
    KnobText, System,
    graph_file::{GraphFile, GraphFileError},
};

use crate::summary::text::line;

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
    /// The graph file before it was changed on the command line, if it was.
    pub unchanged: Option<Arc<str>>,
    /// The folder of the graph file, from which it names its files: models lie there or below.
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
            unchanged: None,
            folder: PathBuf::new(),
        }
    }

    /// Returns the program for `recording`: of another system if that has a graph file.
    pub fn for_recording(&self, recording: &Recording) -> Self {
        let graph = recording.graph_system(&recorded_plant(recording, &self.built_in));
        Self {
            course: self.course && graph.is_none(),
            built_in: self.built_in.clone(),
            file: None,
            unchanged: None,
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
    Path::new(&called)
        .file_stem()
        .and_then(|name| name.to_str())
        .unwrap_or("ratelab")
        .to_owned()
}

/// Returns the command line of these `words`.
pub fn command_line<W: AsRef<str>>(words: impl IntoIterator<Item = W>) -> String {
    words
        .into_iter()
        .map(|word| quoted(word.as_ref()))
        .collect::<Vec<_>>()
        .join(" ")
}

/// Returns a word as a shell reads it.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "_-./:=,@%+".contains(c);
    match word {
        word if !word.is_empty() && word.chars().all(plain) => word.to_owned(),
        word if !word.contains(['"', '$', '`', '\\', '!']) => format!("\"{word}\""),
        word => format!("'{}'", word.replace('\'', r"'\''")),
    }
}

const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The commit, such as `1a2b3c4 + changes`, if it is known.
const COMMIT: Option<&str> = option_env!("RATELAB_COMMIT");

/// The day of the commit, such as `2026-03-14`, if it is known.
pub const DATE: Option<&str> = option_env!("RATELAB_DATE");

/// Returns a line to follow the name.
pub fn short(program: &Program) -> String {
    let version = version(program);
    match (COMMIT, DATE) {
        (Some(commit), Some(date)) => format!("{version} ({commit}, {date})"),
        _ => version,
    }
}

/// Programs other than ratelab have their own versions.
fn version(program: &Program) -> String {
    let with = if program.course { "" } else { "with ratelab " };
    format!("{with}{VERSION}")
}

/// Several lines to follow the name.
pub fn long(program: &Program) -> String {
    let onnx = if RUNS_ONNX {
        "yes, where the ONNX Runtime is installed"
    } else {
        "no: built without the feature onnx"
    };
    let unknown = "unknown";
    let facts = [
        ("commit", COMMIT.unwrap_or(unknown)),
        ("date", DATE.unwrap_or(unknown)),
        ("target", env!("RATELAB_TARGET")),
        ("profile", env!("RATELAB_PROFILE")),
        ("rustc", option_env!("RATELAB_RUSTC").unwrap_or(unknown)),
        ("MuJoCo", mujoco_version()),
        ("rerun", &rerun_version()),
        ("ONNX", onnx),
    ]
    .map(|(name, fact)| line(name, fact));
    format!("{}\n{}", version(program), facts.join("\n"))
}

/// Returns the systems that `graph` may have in its middle: the built-in one, and its plant with
/// files in `folder` or below.
///
/// # Errors
/// [`GraphFileError`] with the key that is wrong.
pub fn known_plants(
    graph: &GraphFile,
    folder: &Path,
    built_in: &Arc<dyn System>,
) -> Result<Vec<Arc<dyn System>>, GraphFileError> {
    let mut known = vec![built_in.clone()];
    if let Some(spec) = graph.plant() {
        // An empty path means the current folder, which is opened as `.`.
        let plant = RobotPlant::load(&folder.join("."), spec);
        let plant =
            plant.map_err(|defect| graph.plant_error(defect.key, defect.item, defect.what))?;
        known.push(Arc::new(plant));
    }
    Ok(known)
}

/// Returns the systems that the graph of `recording` may have in its middle; its plant needs no file.
fn recorded_plant(recording: &Recording, built_in: &Arc<dyn System>) -> Vec<Arc<dyn System>> {
    let origin = &recording.origin;
    let plant = || {
        let graph = GraphFile::parse(origin.graph_file.as_ref()?).ok()?;
        let plant = RobotPlant::recorded(origin.plant.as_ref()?, graph.plant()?);
        Some(Arc::new(plant.ok()?) as Arc<dyn System>)
    };
    [built_in.clone()].into_iter().chain(plant()).collect()
}
