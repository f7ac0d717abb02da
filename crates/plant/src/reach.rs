//! Sites of a robot that are to move, and the joints that take them there.

use std::sync::Mutex;

use nalgebra::{DMatrix, DVector};
use ratelab::{Time, sync::lock};

use crate::{
    BodyData, model::RobotModel, model_error::RobotModelError, motion::SiteMotion,
    reference::Reference,
};

/// The most steps on the way to a pose.
const STEPS: usize = 30;

/// The distance from the goal at which a site counts as there (m).
const THERE: f64 = 1e-10;

/// The damping of a step: where the robot does not reach the goal, it stays near.
const DAMPING: f64 = 1e-4;

/// The longest step of a coordinate (m, rad).
const LONGEST: f64 = 0.3;

/// The time over which the speeds of joints are taken (ns).
const SHORT_NS: u64 = 1_000_000;

/// The sites that are to move, and the robot that tries poses.
pub(crate) struct SiteReach {
    motions: Vec<SiteMotion>,
    data: Mutex<BodyData>,
    at: Vec<f64>,
    /// The coordinates of hinges and slides, which move the sites.
    moving: Vec<usize>,
    /// Where the sites are in the pose (m).
    start: Vec<f64>,
}

impl SiteReach {
    /// Creates the sites with these `motions` of a robot that is `at` its reference.
    ///
    /// # Errors
    /// [`RobotModelError`] if MuJoCo has no room for the robot.
    pub(crate) fn new(
        model: &RobotModel,
        at: &Reference,
        motions: Vec<SiteMotion>,
    ) -> Result<Self, RobotModelError> {
        let mut data = model.body()?;
        at.put_into(&mut data);
        let moving = model
            .joints
            .iter()
            .filter(|joint| joint.is_single())
            .map(|joint| joint.speed)
            .collect();
        let start = places(&mut data, &motions, &at.positions);
        Ok(Self {
            start,
            motions,
            data: Mutex::new(data),
            at: at.positions.clone(),
            moving,
        })
    }

    /// Returns the coordinates that may move.
    pub(crate) fn coordinates(&self) -> &[usize] {
        &self.moving
    }

    /// Returns the sites with their axes, such as `tip.x`.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.motions.iter().map(|motion| &*motion.name)
    }

    /// Adds to `target`, how far each coordinate is from the pose and then how fast, what takes the sites
    /// to where they are to be at run time `now`.
    pub(crate) fn add(&self, model: &RobotModel, target: &mut [f64], now: Time) {
        let (amounts, speeds) = target.split_at_mut(target.len() / 2);
        let later = Time::from_nanos(now.as_nanos() + SHORT_NS);
        let [here, there] = [now, later].map(|time| self.amounts(model, amounts, time));
        for (index, (here, there)) in here.iter().zip(&there).enumerate() {
            amounts[index] += here;
            speeds[index] += (there - here) / (SHORT_NS as f64 / 1e9);
        }
    }

    /// Returns how far each coordinate moves beside what other motions ask for.
    fn amounts(&self, model: &RobotModel, others: &[f64], time: Time) -> Vec<f64> {
        let goals = self.motions.iter().zip(&self.start);
        let goals: Vec<f64> = goals
            .map(|(motion, start)| start + motion.path.at(time)[0])
            .collect();
        let mut positions = self.at.clone();
        model.mujoco.integrate_pos(&mut positions, others, 1.0);
        let mut amounts = vec![0.0; others.len()];
        let mut data = lock(&self.data);
        for _ in 0..STEPS {
            let here = places(&mut data, &self.motions, &positions);
            let missing = goals.iter().zip(&here).map(|(goal, here)| goal - here);
            let missing = DVector::from_iterator(goals.len(), missing);
            if missing.amax() < THERE {
                break;
            }
            let Some(mut step) = self.step(&mut data, &missing) else {
                break;
            };
            let widest = step.amax();
            if widest > LONGEST {
                step *= LONGEST / widest;
            }
            let mut along = vec![0.0; others.len()];
            for (index, way) in self.moving.iter().zip(step.iter()) {
                along[*index] = *way;
                amounts[*index] += way;
            }
            model.mujoco.integrate_pos(&mut positions, &along, 1.0);
        }
        amounts
    }

    /// Returns a damped step of the joints by which the sites come nearer.
    fn step(&self, data: &mut BodyData, missing: &DVector<f64>) -> Option<DVector<f64>> {
        data.com_pos();
        let rows = self.motions.iter().map(|motion| {
            let place = data.site_xpos()[motion.site];
            let (along, _) = data.jac(true, false, &place, motion.body);
            let width = along.len() / 3;
            self.moving
                .iter()
                .map(|index| along[motion.axis * width + index])
                .collect::<Vec<f64>>()
        });
        let rows: Vec<f64> = rows.flatten().collect();
        let jacobian = DMatrix::from_row_slice(missing.len(), self.moving.len(), &rows);
        let square = &jacobian * jacobian.transpose()
            + DMatrix::identity(missing.len(), missing.len()) * DAMPING;
        let solved = square.cholesky()?.solve(missing);
        Some(jacobian.transpose() * solved)
    }

    /// Returns how far each site is from where it were with other positions (m).
    pub(crate) fn errors(&self, positions: &[f64], wanted: &[f64]) -> Vec<f64> {
        let mut data = lock(&self.data);
        let here = places(&mut data, &self.motions, positions);
        let there = places(&mut data, &self.motions, wanted);
        here.iter()
            .zip(there)
            .map(|(here, there)| here - there)
            .collect()
    }
}

/// Returns where the sites are with these positions, each along its axis (m).
fn places(data: &mut BodyData, motions: &[SiteMotion], positions: &[f64]) -> Vec<f64> {
    data.qpos_mut().copy_from_slice(positions);
    data.kinematics();
    let places = data.site_xpos();
    let of = |motion: &SiteMotion| places[motion.site][motion.axis];
    motions.iter().map(of).collect()
}
