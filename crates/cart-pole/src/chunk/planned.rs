//! The cart-pole as what a policy plans by, and its policies as what is asked.

use std::sync::Arc;

use ratelab::NodeError;
use ratelab_policy::{
    Moment,
    chunk::{PlanModel, PlannedPolicy, PlayedAction},
};

use crate::{Action, NotFinite, Observation, body::Body, policy::Policy};

impl PlayedAction for Action {
    fn from_numbers(numbers: &[f32]) -> Self {
        Self(numbers.first().copied().unwrap_or_default())
    }
}

impl PlanModel for Body {
    type Reading = Observation;

    fn place(&mut self, reading: &Observation) {
        Self::place(self, reading);
    }

    fn reading(&mut self) -> Observation {
        self.observation
    }

    fn act(&mut self, action: &[f32]) {
        self.control_step(Action::from_numbers(action));
    }
}

impl PlannedPolicy<Observation> for Box<dyn Policy> {
    fn begin(&mut self, moment: Moment) {
        (**self).begin(moment);
    }

    fn action(&mut self, reading: &Observation) -> Vec<f32> {
        vec![self.act(reading).0]
    }

    fn chunk_from(&mut self, reading: &Observation) -> Option<Vec<f32>> {
        (**self).chunk_from(reading)
    }

    fn whole_chunk(&mut self, reading: &Observation) -> Option<Arc<[f32]>> {
        (**self).whole_chunk(reading)
    }

    fn crash(&mut self) -> Option<String> {
        (**self).crash()
    }

    fn not_finite(&self, answer: f32, reading: &Observation) -> NodeError {
        NotFinite::new(self.name(), Action(answer), *reading).into()
    }

    fn swap(&mut self, name: &str) -> Result<String, NodeError> {
        Ok((**self).swap(name)?)
    }

    fn restart(&mut self) -> Result<(), NodeError> {
        Ok((**self).restart()?)
    }
}
