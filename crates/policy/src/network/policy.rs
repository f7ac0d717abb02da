//! A network that is asked.

use std::sync::Arc;

use super::Mlp;
use crate::{AnswerKind, RowPolicy};

/// Answers with the outputs of a network. A decision allocates no memory.
pub(crate) struct Network {
    weights: Arc<Mlp>,
    seen: Vec<f32>,
    /// The last outputs of all layers.
    outputs: Vec<Vec<f32>>,
    answer: Vec<f64>,
    /// Numbers of an action.
    width: usize,
}

impl Network {
    /// Creates a policy with these weights, for actions of `width` numbers.
    pub(crate) fn new(weights: Arc<Mlp>, width: usize) -> Self {
        Self {
            width,
            seen: vec![0.0; weights.inputs()],
            outputs: weights.room(),
            answer: vec![0.0; weights.actions()],
            weights,
        }
    }
}

impl RowPolicy for Network {
    fn answer(&mut self, observation: &[f64]) -> &[f64] {
        for (seen, number) in self.seen.iter_mut().zip(observation) {
            *seen = *number as f32;
        }
        self.weights.prepare(&mut self.seen);
        let answer = self.weights.run(&self.seen, &mut self.outputs);
        for (number, output) in self.answer.iter_mut().zip(answer) {
            *number = f64::from(*output);
        }
        &self.answer
    }

    fn kind(&self) -> AnswerKind {
        AnswerKind::from_size(self.answer.len(), self.width)
    }
}
