//! The inner loop of a cascade: the gains on a few joints in a node of their own, with its own sensor.
//!
//! ```text
//! sensor ──/obs──► policy ──/command──► inner ──/action──► actuator
//!                  inner-sensor ──/inner-obs──┘
//! ```
//!
//! The gains of `lqr` are split by columns, so that both loops at one rate and without delays are the
//! controller that they were split from.

use nalgebra::DMatrix;
use ratelab::{Flow, Hz, Node, Publisher, Subscription, Tick, TickResult};

use crate::{
    nodes::{ACTUATOR, POLICY, SENSOR},
    robot::{Robot, SharedRobot},
    target::TargetReader,
    world::RobotRow,
};

/// Name of the node with the inner loop.
pub(crate) const INNER: &str = "inner";

/// Name of the node that reads the plant for it.
pub(crate) const INNER_SENSOR: &str = "inner-sensor";

/// Name of the topic from its sensor to it.
pub const INNER_OBS: &str = "/inner-obs";

/// Name of the topic from the policy to it.
pub const COMMAND: &str = "/command";

/// Adds its part to the policy's newest controls, for the newest reading.
pub(crate) struct RobotInner {
    pub(crate) robot: SharedRobot,
    /// The gains, zero for all that the policy holds.
    pub(crate) gains: DMatrix<f64>,
    pub(crate) commands: Subscription<RobotRow>,
    pub(crate) readings: Subscription<RobotRow>,
    pub(crate) actions: Publisher<RobotRow>,
    pub(crate) target: TargetReader,
}

impl Node for RobotInner {
    fn tick(&mut self, tick: &mut Tick) -> TickResult {
        let command = tick.read(&mut self.commands);
        let Some(reading) = tick.read(&mut self.readings) else {
            return Ok(Flow::Continue);
        };
        let seen = self.target.seen(tick, &self.robot, &reading.data);
        // Before the first command it holds its joints alone.
        let controls = command
            .as_ref()
            .map_or(&*self.robot.at.controls, |command| &command.data.0);
        let action = self.robot.fed_back(controls, &self.gains, &seen.0);
        // The age of a push is that of the inner reading, whatever the age of the command.
        tick.publish_from(&self.actions, RobotRow(action.into()), &reading);
        Ok(Flow::Continue)
    }
}

impl Robot {
    /// Returns the nodes that tick at a rate, each with the rate in the file.
    pub(crate) fn rates(&self) -> Vec<(&'static str, Hz)> {
        let (rate, inner) = (self.spec.rate, self.spec.inner.as_ref());
        let fast = inner.map_or(rate, |inner| inner.rate);
        let nodes = inner.map(|_| [(INNER_SENSOR, fast), (INNER, fast)]);
        let usual = [(SENSOR, rate), (POLICY, rate), (ACTUATOR, fast)];
        usual
            .into_iter()
            .chain(nodes.into_iter().flatten())
            .collect()
    }

    /// Returns the rate of a node in the file.
    pub(crate) fn rate_of(&self, node: &str) -> Hz {
        let rates = self.rates();
        let known = rates.iter().find(|(known, _)| *known == node);
        known.map_or(self.spec.rate, |(_, hz)| *hz)
    }

    /// Splits gains into the policy's and the inner loop's.
    pub(crate) fn split(&self, gains: &DMatrix<f64>) -> [DMatrix<f64>; 2] {
        let [_, coordinates, ..] = self.model.sizes();
        let mut parts = [gains.clone(), gains.clone()];
        for column in 0..gains.ncols() {
            // Coordinates, then their speeds, then activations.
            let is_moving = column < 2 * coordinates;
            let is_inner = is_moving && self.inner.contains(&(column % coordinates));
            parts[usize::from(!is_inner)].column_mut(column).fill(0.0);
        }
        parts
    }
}
