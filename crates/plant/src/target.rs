//! The node that tells the policy where the robot is to be, and what the policy makes of that.

use ratelab::{Flow, Node, Publisher, Subscription, Tick, TickResult, Time};

use crate::{
    reach::SiteReach,
    robot::{Robot, SharedRobot},
    world::RobotRow,
};

/// Name of the node with the reference, where that moves.
pub(crate) const TARGET_NODE: &str = "target";

/// Name of its topic.
pub(crate) const TARGET: &str = "/target";

/// Publishes how far each coordinate is to be from the pose, and how fast.
pub(crate) struct RobotTarget {
    pub(crate) robot: SharedRobot,
    pub(crate) targets: Publisher<RobotRow>,
}

impl Node for RobotTarget {
    fn tick(&mut self, tick: &mut Tick) -> TickResult {
        let target = self.robot.target(tick.now());
        tick.publish(&self.targets, RobotRow(target.into()));
        Ok(Flow::Continue)
    }
}

/// The newest target that a policy knows; nothing where the reference stands still.
pub(crate) struct TargetReader(pub(crate) Option<Subscription<RobotRow>>);

impl TargetReader {
    /// Returns a reading as it is seen from the newest target, with the target behind it.
    pub(crate) fn seen(
        &mut self,
        tick: &mut Tick,
        robot: &SharedRobot,
        reading: &RobotRow,
    ) -> RobotRow {
        let target = self.0.as_mut().and_then(|targets| tick.read(targets));
        let Some(target) = target else {
            return reading.clone();
        };
        let mut seen = reading.0.to_vec();
        robot.seen_from(&target.data.0, &mut seen);
        seen.extend(&*target.data.0);
        RobotRow(seen.into())
    }
}

impl Robot {
    /// Returns whether the reference moves.
    pub(crate) fn is_moving(&self) -> bool {
        !self.motions.is_empty() || self.reach.is_some()
    }

    /// Returns how far each coordinate is to be from the pose at run time `now`, then the speed of
    /// each.
    pub(crate) fn target(&self, now: Time) -> Vec<f64> {
        let [_, coordinates, ..] = self.model.sizes();
        let mut target = vec![0.0; 2 * coordinates];
        for motion in &self.motions {
            let [amount, speed] = motion.at(now);
            target[motion.index] += amount;
            target[coordinates + motion.index] += speed;
        }
        if let Some(reach) = &self.reach {
            reach.add(&self.model, &mut target, now);
        }
        target
    }

    /// Returns what a state has beside positions, speeds and activations: how far the coordinates
    /// that move are to be from the pose at run time `now`.
    pub(crate) fn moved(&self, now: Time) -> Vec<f64> {
        if !self.is_moving() {
            return Vec::new();
        }
        let target = self.target(now);
        self.moving.iter().map(|index| target[*index]).collect()
    }

    /// Returns the square of the distance from a reference that moves, in a row of `/state`: of the
    /// joints and the sites that are named.
    pub(crate) fn error(&self, row: &[f64]) -> Option<f64> {
        let (_, state) = row.split_at_checked(self.half.len())?;
        let deviation = self.deviation(state)?;
        let joints = self.motions.iter().map(|motion| deviation[motion.index]);
        let sites = self
            .reach
            .as_ref()
            .and_then(|reach| site_errors(reach, self, row));
        Some(
            joints
                .chain(sites.unwrap_or_default())
                .map(|error| error * error)
                .sum(),
        )
    }

    /// Changes a reading to what it would be if the reference stood still and the robot were as far
    /// from it as it now is from `target`.
    pub(crate) fn seen_from(&self, target: &[f64], reading: &mut [f64]) {
        let [positions, coordinates, ..] = self.model.sizes();
        let (Some((places, rest)), Some((amounts, speeds))) = (
            reading.split_at_mut_checked(positions),
            target.split_at_checked(coordinates),
        ) else {
            return;
        };
        self.model.mujoco.integrate_pos(places, amounts, -1.0);
        for (speed, of_target) in rest.iter_mut().zip(speeds) {
            *speed -= of_target;
        }
    }
}

/// Returns how far each site is from where it is to be, in a row of `/state` of `robot` (m).
pub(crate) fn site_errors(reach: &SiteReach, robot: &Robot, row: &[f64]) -> Option<Vec<f64>> {
    let [positions, coordinates, _, controls] = robot.model.sizes();
    let places = row.get(controls..controls + positions)?;
    let moved = row.get(controls + robot.model.state_size()..)?;
    let mut along = vec![0.0; coordinates];
    for (index, by) in robot.moving.iter().zip(moved) {
        along[*index] = *by;
    }
    let mut wanted = robot.at.positions.clone();
    robot.model.mujoco.integrate_pos(&mut wanted, &along, 1.0);
    Some(reach.errors(places, &wanted))
}
