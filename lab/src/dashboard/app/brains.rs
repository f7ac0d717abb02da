//! Swapping the brain of the running graph.

use std::{fs, path::Path};

use ratelab::{
    experiment::{Config, Knob},
    policy::{Brain, PolicyKind, UnknownPolicy},
};

use super::App;
use crate::dashboard::ladder::Way;

/// Where brains lie that nobody has to name.
const FOLDER: &str = "policies";

/// Kinds of files that brains come in.
const EXTENSIONS: [&str; 3] = ["pt", "safetensors", "onnx"];

/// What there is to choose from: the brains that are built in, those that
/// `config` names, and the files in [`FOLDER`] below the current folder.
pub(super) fn available(config: &Config) -> Vec<Brain> {
    let mut brains: Vec<Brain> = PolicyKind::ALL.map(Brain::from).to_vec();
    let named = config.brains().cloned();
    for brain in named.chain(files(Path::new(FOLDER))) {
        if !brains.iter().any(|known| path(known) == path(&brain)) {
            brains.push(brain);
        }
    }
    // Nobody passes by those that drop the pole on the way to one that does not.
    brains.sort_by_key(|brain| !brain.balances());
    brains
}

/// The files of brains in `folder`, if there is such a folder.
fn files(folder: &Path) -> Vec<Brain> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut paths: Vec<_> = entries.map(|entry| entry.path()).collect();
    paths.retain(|path| {
        let extension = path.extension().and_then(|extension| extension.to_str());
        extension.is_some_and(|extension| EXTENSIONS.contains(&extension))
    });
    paths.sort();
    let brains = paths.iter().filter_map(|path| path.to_str()?.parse().ok());
    brains.collect()
}

/// What two brains that are the same have in common, whatever the content of
/// the file was when they were named.
fn path(brain: &Brain) -> &str {
    match brain {
        Brain::BuiltIn(kind) => kind.name(),
        Brain::File(file) => file.path(),
    }
}

/// The same brain with the content that its file has now.
pub(super) fn as_it_is_now(brain: &Brain) -> Result<Brain, String> {
    let named: Brain = path(brain)
        .parse()
        .map_err(|error: UnknownPolicy| error.to_string())?;
    named.pinned().map_err(|error| error.to_string())
}

impl App {
    /// Swaps the brain for a neighbouring one, as it is now.
    pub(super) fn change_policy(&mut self, way: Way) {
        let count = self.brains.len();
        let known = self.brains.iter();
        let index = known
            .map(path)
            .position(|known| known == path(&self.config.policy));
        let step = if way == Way::Up { 1 } else { count - 1 };
        match as_it_is_now(&self.brains[(index.unwrap_or(0) + step) % count]) {
            Ok(brain) => self.turn(Knob::Policy(brain)),
            Err(reason) => self.say(reason),
        }
    }
}
