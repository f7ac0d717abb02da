//! Policies that were read.

use std::sync::{Arc, Mutex, PoisonError};

use super::{LoadedPolicy, PolicyError, PolicySpec};

/// Policies in memory, so that a file is read, hashed and parsed once: when it is
/// named, before a run begins, and not on a node's thread. Copies share what is
/// read, also what is read later.
#[derive(Clone, Debug, Default)]
pub struct PolicyCache(Arc<Mutex<Vec<(PolicySpec, LoadedPolicy)>>>);

impl PolicyCache {
    /// The policy from the cache; one that is not there is read and put there.
    ///
    /// # Errors
    /// [`PolicyError`] if it cannot be loaded.
    pub fn fetch(&self, spec: &PolicySpec) -> Result<LoadedPolicy, PolicyError> {
        if let Some(loaded) = self.get(spec) {
            return Ok(loaded);
        }
        let loaded = spec.load()?;
        self.put(spec, &loaded);
        Ok(loaded)
    }

    /// `spec` pinned to the content that its file has now, which is read and put
    /// into the cache. One that is pinned stays as it is.
    ///
    /// # Errors
    /// [`PolicyError`] if it cannot be loaded.
    pub fn pin(&self, spec: &PolicySpec) -> Result<PolicySpec, PolicyError> {
        if spec.is_pinned() {
            return self.fetch(spec).map(|_| spec.clone());
        }
        let loaded = spec.load()?;
        self.put(loaded.spec(), &loaded);
        Ok(loaded.spec().clone())
    }

    fn get(&self, spec: &PolicySpec) -> Option<LoadedPolicy> {
        let known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let found = known.iter().find(|(known, _)| known == spec);
        found.map(|(_, loaded)| loaded.clone())
    }

    fn put(&self, spec: &PolicySpec, loaded: &LoadedPolicy) {
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if !known.iter().any(|(known, _)| known == spec) {
            known.push((spec.clone(), loaded.clone()));
        }
    }
}
