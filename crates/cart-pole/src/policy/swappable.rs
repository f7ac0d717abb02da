//! A replaceable policy.

use std::sync::Arc;

use ratelab_system::RecordedAnswers;

use super::{
    Moment, Policy, PolicyCache, PolicyContext, PolicyError, PolicyFault, PolicySpec,
    UnknownPolicy,
    rows::{FilePolicy, shape},
    spec::with_names,
};
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
    answers: Option<Arc<RecordedAnswers>>,
}

impl SwappablePolicy {
    /// Creates it with the policy `first`. A program is not started if its recorded `answers` are
    /// given.
    ///
    /// # Errors
    /// [`PolicyError`] if it cannot be loaded or started.
    pub fn new(
        first: &PolicySpec,
        cache: PolicyCache,
        context: PolicyContext,
        answers: Option<Arc<RecordedAnswers>>,
    ) -> Result<Self, PolicyError> {
        let (now, spec) = make(first, &cache, context, answers.as_ref())?;
        Ok(Self {
            now,
            first: spec.clone(),
            spec,
            context,
            cache,
            answers,
        })
    }
}

/// Makes the policy of `spec`, ready to be asked; returns it with its text.
fn make(
    spec: &PolicySpec,
    cache: &PolicyCache,
    context: PolicyContext,
    answers: Option<&Arc<RecordedAnswers>>,
) -> Result<(Box<dyn Policy>, String), PolicyError> {
    match spec {
        PolicySpec::BuiltIn(_) => Ok((spec.load()?.policy(context)?, spec.to_string())),
        PolicySpec::File(file) => {
            let terms = cache.terms.clone();
            let started = cache.files.start(file, context, shape(&terms), answers);
            let (rows, file) = started.map_err(with_names)?;
            let spec = PolicySpec::File(file);
            Ok((
                Box::new(FilePolicy::new(spec.name(), rows, terms)),
                spec.to_string(),
            ))
        }
    }
}

impl Policy for SwappablePolicy {
    fn name(&self) -> &str {
        self.now.name()
    }

    fn begin(&mut self, moment: Moment) {
        self.now.begin(moment);
    }

    fn act(&mut self, observation: &Observation) -> Action {
        self.now.act(observation)
    }

    fn chunk_from(&mut self, state: &Observation) -> Option<Vec<f32>> {
        self.now.chunk_from(state)
    }

    fn whole_chunk(&mut self, reading: &Observation) -> Option<Arc<[f32]>> {
        self.now.whole_chunk(reading)
    }

    fn crash(&mut self) -> Option<String> {
        self.now.crash()
    }

    fn swap(&mut self, name: &str) -> Result<String, PolicyFault> {
        let spec: PolicySpec = name
            .parse()
            .map_err(|error: UnknownPolicy| PolicyFault::Other(error.to_string()))?;
        let (next, spec) = make(&spec, &self.cache, self.context, self.answers.as_ref())?;
        self.now = next;
        Ok(std::mem::replace(&mut self.spec, spec))
    }

    fn restart(&mut self) -> Result<(), PolicyFault> {
        let first = self.first.clone();
        self.swap(&first).map(drop)
    }
}
