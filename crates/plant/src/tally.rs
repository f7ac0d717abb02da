//! What a run of a robot cost.

use ratelab_policy::chunk::{CHUNK, ChunkTally, PLAYER_STEP};
use ratelab_system::{FigureValue, RunTally, SystemFigure};

use crate::{nodes::STATE, robot::SharedRobot};

/// Adds up what the states of a run cost.
pub(crate) struct RobotTally {
    robot: SharedRobot,
    sum: f64,
    /// The squares of the distances from a reference that moves.
    errors: f64,
    rows: u64,
    /// Of a policy that answers with chunks.
    chunks: Option<ChunkTally>,
}

impl RobotTally {
    /// Creates one for a run of `robot`, with `chunks` or without, and without a state so far.
    pub(crate) fn new(robot: SharedRobot, chunks: bool) -> Self {
        let width = robot.half.len();
        Self {
            chunks: chunks.then(|| ChunkTally::new(width)),
            robot,
            sum: 0.0,
            errors: 0.0,
            rows: 0,
        }
    }
}

impl RunTally for RobotTally {
    fn topics(&self) -> &'static [&'static str] {
        match self.chunks {
            Some(_) => &[STATE, CHUNK, PLAYER_STEP],
            None => &[STATE],
        }
    }

    fn message(&mut self, topic: &str, row: &[f64]) {
        if topic != STATE {
            if let Some(chunks) = &mut self.chunks {
                chunks.message(topic, row);
            }
        } else if let Some(cost) = self.robot.cost(row) {
            self.sum += cost;
            self.rows += 1;
            self.errors += self.robot.error(row).unwrap_or_default();
        }
    }

    fn figures(&self) -> Vec<SystemFigure> {
        let mean = (self.rows > 0).then(|| self.sum / self.rows as f64);
        let cost = SystemFigure {
            block: None,
            name: "plant_cost",
            text: "mean of (x/limit)^2 + (u/half range)^2: {}",
            value: FigureValue::Number(mean),
        };
        let error = (self.rows > 0).then(|| (self.errors / self.rows as f64).sqrt());
        let tracking = self.robot.is_moving().then_some(SystemFigure {
            block: None,
            name: "tracking_error",
            text: "tracking error {} m, rad: root mean square distance from the reference",
            value: FigureValue::Number(error),
        });
        let chunks = self.chunks.iter().flat_map(RunTally::figures);
        [cost].into_iter().chain(tracking).chain(chunks).collect()
    }
}
