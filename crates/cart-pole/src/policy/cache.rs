//! A cache of loaded policies.

use std::sync::{Arc, Mutex};

use ratelab::sync::lock;

use super::{LoadedPolicy, PolicyError, PolicyFile, PolicySpec};

/// Policies in memory, so that a file is read, hashed and parsed only once, before a run
/// begins and outside of a node's thread. Clones share their entries, including later
/// ones.
#[derive(Clone, Debug, Default)]
pub struct PolicyCache(Arc<Mutex<Vec<(PolicySpec, LoadedPolicy)>>>);

impl PolicyCache {
    /// Returns the policy from the cache, after loading it if necessary.
    ///
    /// # Errors
    /// [`PolicyError`] if it cannot be loaded.
    pub fn fetch(&self, spec: &PolicySpec) -> Result<LoadedPolicy, PolicyError> {
        if let Some(loaded) = self.get(spec) {
            return Ok(loaded);
        }
        let loaded = spec.load()?;
        self.put(spec, &loaded);
        self.put(loaded.spec(), &loaded);
        Ok(loaded)
    }

    /// Loads the file of `spec` into the cache, with the digest of its current content; a pinned
    /// `spec` stays as it is.
    ///
    /// # Errors
    /// [`PolicyError`] if it cannot be loaded.
    pub fn pin(&self, spec: &PolicySpec) -> Result<LoadedPolicy, PolicyError> {
        if !matches!(spec, PolicySpec::File(file) if file.sha256.is_none()) {
            return self.fetch(spec);
        }
        let loaded = spec.load()?;
        self.put(loaded.spec(), &loaded);
        Ok(loaded)
    }

    /// Returns whether a program with the content of this pinned one has been loaded, from
    /// wherever.
    pub(super) fn knows_program(&self, program: &PolicyFile) -> bool {
        let known = lock(&self.0);
        let is_same = |known: &PolicyFile| known.is_program && known.sha256 == program.sha256;
        let mut specs = known.iter().map(|(spec, _)| spec);
        program.sha256.is_some()
            && specs.any(|known| matches!(known, PolicySpec::File(file) if is_same(file)))
    }

    fn get(&self, spec: &PolicySpec) -> Option<LoadedPolicy> {
        let known = lock(&self.0);
        let found = known.iter().find(|(known, _)| known == spec);
        found.map(|(_, loaded)| loaded.clone())
    }

    fn put(&self, spec: &PolicySpec, loaded: &LoadedPolicy) {
        let mut known = lock(&self.0);
        if !known.iter().any(|(known, _)| known == spec) {
            known.push((spec.clone(), loaded.clone()));
        }
    }
}
