//! A cache of loaded policies.

use ratelab_policy::{PolicyError, PolicyFiles};

use super::{LoadedPolicy, PolicySpec};

/// Policies in memory, so that a file is read, hashed and parsed only once, before a run
/// begins and outside of a node's thread. Clones share their entries, including later
/// ones.
#[derive(Clone, Debug, Default)]
pub struct PolicyCache(pub(super) PolicyFiles);

impl PolicyCache {
    /// Returns the policy from the cache, after loading it if necessary.
    ///
    /// # Errors
    /// [`PolicyError`] if it cannot be loaded.
    pub fn fetch(&self, spec: &PolicySpec) -> Result<LoadedPolicy, PolicyError> {
        spec.load_by(|file| self.0.fetch(file))
    }

    /// Loads the file of `spec` into the cache, with the digest of its current content; a pinned
    /// `spec` stays as it is.
    ///
    /// # Errors
    /// [`PolicyError`] if it cannot be loaded.
    pub fn pin(&self, spec: &PolicySpec) -> Result<LoadedPolicy, PolicyError> {
        spec.load_by(|file| self.0.pin(file))
    }
}
