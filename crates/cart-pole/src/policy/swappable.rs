//! A replaceable policy.

use super::{Policy, PolicyCache, PolicyContext, PolicyError, PolicySpec};
use crate::{Action, Observation};

/// Decides with one policy until it is replaced by another. A policy in its cache needs
/// no access to files.
pub struct SwappablePolicy {
    now: Box<dyn Policy>,
    /// The initial policy, as text.
    first: String,
    /// The current policy, as text.
    spec: String,
    context: PolicyContext,
    cache: PolicyCache,
}

impl SwappablePolicy {
    /// Creates it with the policy `first`.
    ///
    /// # Errors
    /// [`PolicyError`] if it cannot be loaded.
    pub fn new(
        first: &PolicySpec,
        cache: PolicyCache,
        context: PolicyContext,
    ) -> Result<Self, PolicyError> {
        let loaded = cache.fetch(first)?;
        Ok(Self {
            now: loaded.policy(context)?,
            first: loaded.spec().to_string(),
            spec: loaded.spec().to_string(),
            context,
            cache,
        })
    }
}

impl Policy for SwappablePolicy {
    fn name(&self) -> &str {
        self.now.name()
    }

    fn act(&mut self, observation: &Observation) -> Action {
        self.now.act(observation)
    }

    fn plan_chunk(&mut self, observation: &Observation) -> Option<Vec<f32>> {
        self.now.plan_chunk(observation)
    }

    fn swap(&mut self, name: &str) -> Result<String, String> {
        let spec: PolicySpec = name.parse().map_err(|error| format!("{error}"))?;
        let loaded = self.cache.fetch(&spec).map_err(|error| error.to_string())?;
        let next = loaded
            .policy(self.context)
            .map_err(|error| error.to_string())?;
        self.now = next;
        let spec = loaded.spec().to_string();
        Ok(std::mem::replace(&mut self.spec, spec))
    }

    fn restart(&mut self) -> Result<(), String> {
        let first = self.first.clone();
        self.swap(&first).map(drop)
    }
}
