//! A program that ran when a run was recorded.

use std::sync::Arc;

use ratelab_system::RecordedAnswers;

use super::super::{Moment, Policy};
use crate::{Action, Observation};

/// Answers as a program did when the run was recorded. An answer that was never released, for the
/// run or the node ended before, is none that matters.
pub struct RecordedPolicy {
    name: String,
    answers: Arc<RecordedAnswers>,
    chunk: Option<usize>,
    moment: Moment,
}

impl RecordedPolicy {
    pub fn new(name: &str, answers: Arc<RecordedAnswers>, chunk: Option<usize>) -> Self {
        Self {
            name: name.to_owned(),
            answers,
            chunk,
            moment: Moment::default(),
        }
    }

    /// The actions are the last numbers of the message, which is an action or a chunk.
    fn actions(&self) -> Vec<f32> {
        let count = self.chunk.unwrap_or(1);
        let answer = self.answers.get(&self.moment.now);
        let row = answer.and_then(|answer| answer.as_ref().ok());
        let actions = row
            .and_then(|row| row.get(row.len().checked_sub(count)?..))
            .map(|actions| actions.iter().map(|action| *action as f32).collect());
        actions.unwrap_or_else(|| vec![0.0; count])
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
        self.actions()
            .first()
            .map_or(Action::ZERO, |action| Action(*action))
    }

    fn whole_chunk(&mut self, _: &Observation) -> Option<Arc<[f32]>> {
        Some(self.actions().into())
    }

    fn crash(&mut self) -> Option<String> {
        let answer = self.answers.get(&self.moment.now)?;
        answer.as_ref().err().cloned()
    }
}
