//! A cache of loaded policies.

use ratelab_policy::{PolicyError, PolicyFiles};

use super::{CartTerms, LoadedPolicy, PolicySpec};

/// Policies in memory, so that a file is read, hashed and parsed only once, before a run
/// begins and outside of a node's thread. Clones share their entries, including later
/// ones.
#[derive(Clone, Debug, Default)]
pub struct PolicyCache {
    pub(super) files: PolicyFiles,
    /// What policies in files see.
    pub(super) terms: CartTerms,
}

impl PolicyCache {
    /// Returns one with the same entries, whose policies see these `terms`.
    pub fn seeing(&self, terms: CartTerms) -> Self {
        let files = self.files.clone();
        Self { files, terms }
    }

    /// Returns the policy from the cache, after loading it if necessary.
    ///
    /// # Errors
    /// [`PolicyError`] if it cannot be loaded.
    pub fn fetch(&self, spec: &PolicySpec) -> Result<LoadedPolicy, PolicyError> {
        spec.load_by(&self.terms, |file| self.files.fetch(file))
    }

    /// Loads the file of `spec` into the cache, with the digest of its current content; a pinned
    /// `spec` stays as it is.
    ///
    /// # Errors
    /// [`PolicyError`] if it cannot be loaded.
    pub fn pin(&self, spec: &PolicySpec) -> Result<LoadedPolicy, PolicyError> {
        spec.load_by(&self.terms, |file| self.files.pin(file))
    }
}
