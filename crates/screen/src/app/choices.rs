//! The choices of messages, for the first alias of a message with a list of values.

use std::{fs, path::Path};

use ratelab::{Knob, KnobKind};
use ratelab_experiment::Config;
use ratelab_system::{Alias, Setup, System, names::first_alias};

use super::App;
use crate::{
    error::KeyError,
    knobs::{Direction, neighbour, with_message},
};

/// The folder for files of policies.
const FOLDER: &str = "policies";

/// Extensions of files of policies.
const EXTENSIONS: [&str; 3] = ["pt", "safetensors", "onnx"];

/// Returns the choices: the values of the alias, the one in `config`, and the files in [`FOLDER`]
/// below the current folder, if the alias accepts files.
pub(super) fn available(system: &dyn System, config: &Config) -> Vec<String> {
    let Some((alias, node)) = sent(system) else {
        return Vec::new();
    };
    let timed = config.knobs.iter().map(|timed| &timed.knob);
    let named = config
        .setup
        .iter()
        .chain(timed)
        .filter_map(|knob| match knob {
            Knob::Send { node: of, text } if of == node => Some(text.clone()),
            _ => None,
        });
    let files = files(Path::new(FOLDER))
        .into_iter()
        .filter(|file| system.knobs().file(node, file).is_some());
    let mut choices: Vec<String> = alias
        .choices
        .iter()
        .map(|text| (*text).to_owned())
        .collect();
    for text in named.chain(files) {
        let text = unpinned(system, node, &text);
        if !choices.contains(&text) {
            choices.push(text);
        }
    }
    // Policies that always lose come last.
    choices.sort_by_key(|text| {
        let (node, text) = (node.to_owned(), text.clone());
        let setup = Setup::default().with(Knob::Send { node, text });
        system.judge().lost_anyway(&setup).is_some()
    });
    choices
}

/// Returns the first alias of a message, and its node.
fn sent(system: &dyn System) -> Option<(&'static Alias, &'static str)> {
    let alias = first_alias(system, KnobKind::Send)?;
    let (_, node) = alias.knobs.first()?;
    Some((alias, node))
}

/// Returns the files of policies in `folder`, if the folder exists.
fn files(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut paths: Vec<_> = entries.map(|entry| entry.path()).collect();
    paths.retain(|path| {
        let extension = path.extension().and_then(|extension| extension.to_str());
        extension.is_some_and(|extension| EXTENSIONS.contains(&extension))
    });
    paths.sort();
    paths
        .iter()
        .filter_map(|path| path.to_str())
        .map(str::to_owned)
        .collect()
}

/// Returns a message to `node` with the path of its file, without the digest.
fn unpinned(system: &dyn System, node: &str, text: &str) -> String {
    let file = system.knobs().file(node, text);
    file.as_ref()
        .and_then(|file| file.to_str())
        .unwrap_or(text)
        .to_owned()
}

/// Returns `setup` with the current content of its files.
pub(super) fn as_it_is_now(system: &dyn System, setup: &Setup) -> Setup {
    let unpinned = |node: &str, text: &str| unpinned(system, node, text);
    setup
        .iter()
        .map(|knob| with_message(knob, unpinned))
        .collect()
}

impl App {
    /// Sends the neighbouring message, with the current content of its file.
    pub(super) fn choose(&mut self, direction: Direction) {
        let system = &*self.setup.system;
        let next = sent(system).and_then(|(alias, node)| {
            let current = unpinned(system, node, &alias.value(&self.knobs.wanted()));
            let at = self.choices.iter().position(|known| *known == current);
            let next = neighbour(at, self.choices.len(), direction)?;
            let choice = &self.choices[next];
            Some((alias.name, choice.clone(), alias.set(choice)))
        });
        match next {
            Some((name, choice, knobs)) => {
                // Refusals and the end of the run have a notice of their own.
                self.notify(format!("{name} is now {choice}"));
                self.turn(knobs.map_err(KeyError::refused));
            }
            None => self.notify("this system has no messages to choose from"),
        }
    }
}
