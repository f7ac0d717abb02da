//! A program that ran when a run was recorded.

use ratelab_study::system::RecordedAnswers;
use std::sync::Arc;

use super::super::{Moment, Policy};
use crate::{Action, Observation, chunk::Chunk};
use ratelab_account::Fields;

/// Answers as a program did when the run was recorded. An answer that was never released, for the
/// run or the node ended before, is none that matters.
pub struct RecordedPolicy {
    name: String,
    answers: Arc<RecordedAnswers>,
    horizon: Option<usize>,
    moment: Moment,
}

impl RecordedPolicy {
    pub fn new(name: &str, answers: Arc<RecordedAnswers>, horizon: Option<usize>) -> Self {
        Self {
            name: name.to_owned(),
            answers,
            horizon,
            moment: Moment::default(),
        }
    }

    fn answer(&self) -> Option<&[f64]> {
        let answer = self.answers.get(&self.moment.now)?;
        answer.as_deref().ok()
    }
}

impl Policy for RecordedPolicy {
    fn name(&self) -> &str {
        &self.name
    }

    fn begin(&mut self, moment: Moment) {
        self.moment = moment;
    }

    fn act(&mut self, _: &Observation) -> Action {
        let action = self.answer().and_then(Action::from_row);
        action.unwrap_or(Action::ZERO)
    }

    fn chunk(&mut self, _: &Observation) -> Option<Arc<[f32]>> {
        let chunk = self.answer().and_then(Chunk::from_row);
        let actions = chunk.map(|chunk| chunk.actions);
        Some(actions.unwrap_or_else(|| vec![0.0; self.horizon.unwrap_or(0)].into()))
    }

    fn crash(&mut self) -> Option<String> {
        let answer = self.answers.get(&self.moment.now)?;
        answer.as_ref().err().cloned()
    }
}
