//! Policies that were read.

use super::{LoadedPolicy, PolicySpec, error::PolicyError};

/// Policies in memory, so that a run reads them before it begins and a sweep reads
/// them once. Copies share the weights.
#[derive(Clone, Debug, Default)]
pub struct PolicyCache(Vec<(PolicySpec, LoadedPolicy)>);

impl PolicyCache {
    /// Reads `specs`.
    ///
    /// # Errors
    /// [`PolicyError`] if one of them cannot be had.
    pub fn of<'b>(specs: impl IntoIterator<Item = &'b PolicySpec>) -> Result<Self, PolicyError> {
        let mut cache = Self::default();
        for spec in specs {
            cache.fetch(spec)?;
        }
        Ok(cache)
    }

    /// The policy from the cache; one that is not there is read and put there.
    ///
    /// # Errors
    /// [`PolicyError`] if it cannot be had.
    pub fn fetch(&mut self, spec: &PolicySpec) -> Result<LoadedPolicy, PolicyError> {
        if let Some((_, loaded)) = self.0.iter().find(|(known, _)| known == spec) {
            return Ok(loaded.clone());
        }
        let loaded = spec.load()?;
        self.0.push((spec.clone(), loaded.clone()));
        Ok(loaded)
    }
}
