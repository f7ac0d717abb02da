//! A replaceable policy.

use std::sync::Arc;

use ratelab_system::RecordedAnswers;

use super::{
    Moment, Policy, PolicyCache, PolicyContext, PolicyError, PolicyFault, PolicySpec,
    UnknownPolicy, program::RecordedPolicy,
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

/// Makes the policy of `spec`, ready to be asked; returns it with its text. Of a program that is
/// pinned already the name comes from a recording, or another log: that alone starts none.
fn make(
    spec: &PolicySpec,
    cache: &PolicyCache,
    context: PolicyContext,
    answers: Option<&Arc<RecordedAnswers>>,
) -> Result<(Box<dyn Policy>, String), PolicyError> {
    if let PolicySpec::File(program) = spec
        && program.is_program
    {
        if let Some(answers) = answers {
            let recorded = RecordedPolicy::new(spec.name(), answers.clone(), context.chunk);
            return Ok((Box::new(recorded), spec.to_string()));
        }
        if !cache.knows_program(program) {
            let why = "no recording or log starts a program: name one with this content by its \
                       path alone";
            return Err(PolicyError {
                spec: spec.to_string(),
                why: why.to_owned(),
            });
        }
    }
    let loaded = cache.fetch(spec)?;
    loaded.check_chunk(context.chunk)?;
    let mut policy = loaded.policy(context)?;
    policy
        .start()
        .map_err(|why| loaded.error(why.to_string()))?;
    Ok((policy, loaded.spec().to_string()))
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
