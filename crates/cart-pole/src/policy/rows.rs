//! The policy in a file, as a policy of the cart-pole.

use std::{sync::Arc, time::Duration};

use ratelab_policy::{AnswerKind, Moment, PolicyFault, RowPolicy, RowShape};

use super::{CartTerms, Policy};
use crate::{Action, CONTROL_HZ, Observation};

/// Returns what a policy of the cart-pole sees, and answers with.
pub(super) fn shape(terms: &CartTerms) -> RowShape {
    RowShape {
        sees: terms.size(),
        acts: None,
        action_ns: Duration::from_secs_f64(1.0 / CONTROL_HZ).as_nanos() as u64,
    }
}

/// Asks the policy in a file.
pub(super) struct FilePolicy {
    name: String,
    rows: Box<dyn RowPolicy>,
    terms: CartTerms,
    /// What it sees.
    seen: Vec<f64>,
}

impl FilePolicy {
    pub(super) fn new(name: &str, rows: Box<dyn RowPolicy>, terms: CartTerms) -> Self {
        Self {
            name: name.to_owned(),
            rows,
            seen: vec![0.0; terms.size()],
            terms,
        }
    }

    fn answer(&mut self, observation: &Observation) -> &[f64] {
        self.terms.put(observation, &mut self.seen);
        self.rows.answer(&self.seen)
    }

    /// Returns the answer to an observation, if its answers are of this kind.
    fn chunk(&mut self, observation: &Observation, kind: AnswerKind) -> Option<Vec<f32>> {
        let is_so = self.rows.kind() == kind;
        let single = |actions: &[f64]| actions.iter().map(|action| *action as f32).collect();
        is_so.then(|| single(self.answer(observation)))
    }
}

impl Policy for FilePolicy {
    fn name(&self) -> &str {
        &self.name
    }

    fn start(&mut self) -> Result<(), PolicyFault> {
        self.rows.start()
    }

    fn begin(&mut self, moment: Moment) {
        self.rows.begin(moment);
    }

    fn act(&mut self, observation: &Observation) -> Action {
        let first = self.answer(observation).first();
        Action(first.map_or(0.0, |action| *action as f32))
    }

    fn chunk_from(&mut self, state: &Observation) -> Option<Vec<f32>> {
        self.chunk(state, AnswerKind::Chunk)
    }

    fn whole_chunk(&mut self, reading: &Observation) -> Option<Arc<[f32]>> {
        Some(self.chunk(reading, AnswerKind::WholeChunk)?.into())
    }

    fn crash(&mut self) -> Option<String> {
        self.rows.crash()
    }
}
