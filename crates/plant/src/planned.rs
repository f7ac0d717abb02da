//! A robot as what a policy plans by, and its policies as what is asked for a plan.

use std::sync::Arc;

use nalgebra::DMatrix;
use ratelab::NodeError;
use ratelab_policy::{
    AnswerKind, Moment,
    chunk::{PlanModel, PlannedPolicy, PlayedAction},
};

use crate::{
    decide::{NoControl, PolicyMaker, RobotLaw},
    robot::SharedRobot,
    world::{FreeRobot, RobotRow},
};

impl PlayedAction for RobotRow {
    fn from_numbers(numbers: &[f32]) -> Self {
        Self(numbers.iter().copied().map(f64::from).collect())
    }
}

/// A robot of the policy's own.
pub(crate) struct RobotCopy {
    pub(crate) robot: SharedRobot,
    pub(crate) plant: FreeRobot,
    /// The steps of physics in the time that an action is meant for.
    pub(crate) steps: u64,
    /// The gains of an inner loop, with the steps of its period.
    pub(crate) inner: Option<(DMatrix<f64>, u64)>,
}

impl PlanModel for RobotCopy {
    type Reading = RobotRow;

    fn place(&mut self, reading: &RobotRow) {
        self.plant.place(&reading.0);
    }

    fn reading(&mut self) -> RobotRow {
        let mut reading = self.plant.state();
        // Without memory for its terms the policy answers nothing.
        let _ = self.plant.observe(&mut reading);
        RobotRow(reading.into())
    }

    fn act(&mut self, action: &[f32]) {
        let controls: Vec<f64> = action.iter().copied().map(f64::from).collect();
        let Some((gains, period)) = &self.inner else {
            return self.plant.hold(&controls, self.steps);
        };
        let mut left = self.steps;
        while left > 0 {
            let steps = left.min(*period);
            let with_inner = self.robot.fed_back(&controls, gains, &self.plant.state());
            self.plant.hold(&with_inner, steps);
            left -= steps;
        }
    }
}

/// A policy of a robot that is asked for a plan.
pub(crate) struct PlannedRobot {
    pub(crate) law: RobotLaw,
    /// The name of the law at first.
    pub(crate) first: String,
    pub(crate) maker: PolicyMaker,
}

impl PlannedRobot {
    /// Returns the answer to a reading, if its answers are of this kind.
    fn answer(&mut self, reading: &RobotRow, kind: AnswerKind) -> Option<Vec<f32>> {
        let is_so = self.law.kind() == kind;
        is_so.then(|| single(&self.law.answer(&self.maker.robot, &reading.0)))
    }
}

fn single(numbers: &[f64]) -> Vec<f32> {
    numbers.iter().map(|number| *number as f32).collect()
}

impl PlannedPolicy<RobotRow> for PlannedRobot {
    fn begin(&mut self, moment: Moment) {
        self.law.begin(moment);
    }

    fn action(&mut self, reading: &RobotRow) -> Vec<f32> {
        let robot = &self.maker.robot;
        let mut action = single(&self.law.answer(robot, &reading.0));
        // Of a chunk the first one; of a policy that has died none.
        action.resize(robot.half.len(), 0.0);
        action
    }

    fn chunk_from(&mut self, reading: &RobotRow) -> Option<Vec<f32>> {
        self.answer(reading, AnswerKind::Chunk)
    }

    fn whole_chunk(&mut self, reading: &RobotRow) -> Option<Arc<[f32]>> {
        Some(self.answer(reading, AnswerKind::WholeChunk)?.into())
    }

    fn crash(&mut self) -> Option<String> {
        self.law.crash()
    }

    fn not_finite(&self, answer: f32, _: &RobotRow) -> NodeError {
        let (policy, answer) = (self.law.name(), answer.into());
        NoControl { policy, answer }.into()
    }

    fn swap(&mut self, name: &str) -> Result<String, NodeError> {
        let law = self.maker.make(name)?;
        Ok(std::mem::replace(&mut self.law, law).name())
    }

    fn restart(&mut self) -> Result<(), NodeError> {
        self.law = self.maker.make(&self.first)?;
        Ok(())
    }
}
