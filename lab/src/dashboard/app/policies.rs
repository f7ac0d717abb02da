//! Swapping the policy of the running graph.

use std::{fs, path::Path};

use ratelab::{
    experiment::{Config, Knob},
    policy::{PolicyCache, PolicyKind, PolicySpec, UnknownPolicy},
};

use super::App;
use crate::dashboard::presets::Direction;

/// Where policies lie that nobody has to name.
const FOLDER: &str = "policies";

/// Kinds of files that policies come in.
const EXTENSIONS: [&str; 3] = ["pt", "safetensors", "onnx"];

/// What there is to choose from: the policies that are built in, those that
/// `config` names, and the files in [`FOLDER`] below the current folder.
pub(super) fn available(config: &Config) -> Vec<PolicySpec> {
    let mut policies: Vec<PolicySpec> = PolicyKind::ALL.map(PolicySpec::from).to_vec();
    let named = config.policies().cloned();
    for policy in named.chain(files(Path::new(FOLDER))) {
        if !policies.iter().any(|known| path(known) == path(&policy)) {
            policies.push(policy);
        }
    }
    // Nobody passes by those that drop the pole on the way to one that does not.
    policies.sort_by_key(|policy| !policy.balances());
    policies
}

/// The files of policies in `folder`, if there is such a folder.
fn files(folder: &Path) -> Vec<PolicySpec> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut paths: Vec<_> = entries.map(|entry| entry.path()).collect();
    paths.retain(|path| {
        let extension = path.extension().and_then(|extension| extension.to_str());
        extension.is_some_and(|extension| EXTENSIONS.contains(&extension))
    });
    paths.sort();
    let policies = paths.iter().filter_map(|path| path.to_str()?.parse().ok());
    policies.collect()
}

/// What two policies that are the same have in common, whatever the content of
/// the file was when they were named.
fn path(policy: &PolicySpec) -> &str {
    match policy {
        PolicySpec::BuiltIn(kind) => kind.name(),
        PolicySpec::File(file) => file.path(),
    }
}

/// The same policy with the content that its file has now, which is read into
/// `cache`: the node that swaps it in reads no file.
pub(super) fn as_it_is_now(policy: &PolicySpec, cache: &PolicyCache) -> Result<PolicySpec, String> {
    let named: PolicySpec = path(policy)
        .parse()
        .map_err(|error: UnknownPolicy| error.to_string())?;
    cache.pin(&named).map_err(|error| error.to_string())
}

impl App {
    /// Swaps the policy for a neighbouring one, as it is now.
    pub(super) fn change_policy(&mut self, direction: Direction) {
        let count = self.policies.len();
        let known = self.policies.iter();
        let index = known
            .map(path)
            .position(|known| known == path(&self.config.policy));
        let step = if direction == Direction::Up {
            1
        } else {
            count - 1
        };
        let next = &self.policies[(index.unwrap_or(0) + step) % count];
        match as_it_is_now(next, &self.setup.policies) {
            Ok(policy) => self.turn(Knob::Policy(policy)),
            Err(reason) => self.notify(reason),
        }
    }
}
