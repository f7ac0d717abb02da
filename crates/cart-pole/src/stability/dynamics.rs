//! The plant near upright as a differential equation.

use std::time::Duration;

use nalgebra::{Matrix4, Vector4};

use crate::{CONTROL_HZ, LinearPlant, PlantError, SUBSTEPS};

/// The motion of a small deviation from rest: `dx/dt = F·x + G·u`.
///
/// The state `x` is two positions and their two velocities: for the cart-pole cart
/// position (m), pole angle (rad), cart velocity (m/s) and pole velocity (rad/s); `u` is
/// an action.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dynamics {
    /// F: the effect of the state (1/s).
    pub f: Matrix4<f64>,
    /// G: the effect of the action.
    pub g: Vector4<f64>,
}

impl Dynamics {
    /// The dynamics of the cart-pole, from one physics step of MuJoCo.
    ///
    /// A step first updates the velocities, then the positions with the new velocities,
    /// and at rest no force depends on a velocity. Therefore the change of the velocities
    /// in a step is the acceleration times the step, for any length of step.
    ///
    /// # Errors
    /// [`PlantError`] if MuJoCo refuses the model or is out of memory.
    pub fn cart_pole() -> Result<Self, PlantError> {
        let step_s = 1.0 / (CONTROL_HZ * f64::from(SUBSTEPS));
        let LinearPlant { a, b } = LinearPlant::physics_step(1.0)?;
        let mut f = Matrix4::zeros();
        let mut g = Vector4::zeros();
        for position in 0..2 {
            let velocity = position + 2;
            f[(position, velocity)] = 1.0;
            f[(velocity, 0)] = a[(velocity, 0)] / step_s;
            f[(velocity, 1)] = a[(velocity, 1)] / step_s;
            g[velocity] = b[velocity] / step_s;
        }
        Ok(Self { f, g })
    }

    /// One physics step of this length: first the velocities, then the positions.
    pub fn step(&self, step: Duration) -> LinearPlant {
        let step_s = step.as_secs_f64();
        let (mut a, mut b) = (Matrix4::identity(), Vector4::zeros());
        for velocity in 2..4 {
            let faster = a.row(velocity) + self.f.row(velocity) * step_s;
            a.set_row(velocity, &faster);
            b[velocity] = self.g[velocity] * step_s;
        }
        for position in 0..2 {
            let moved = a.row(position) + a.row(position + 2) * step_s;
            a.set_row(position, &moved);
            b[position] = b[position + 2] * step_s;
        }
        LinearPlant { a, b }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use mujoco_rs::prelude::{MjData, MjModel};

    use super::*;

    /// The motion of such small velocities (m/s, rad/s) and positions (m, rad) is linear.
    const SMALL: f64 = 1e-5;

    /// MuJoCo's own `step` from a small deviation.
    fn mujoco(step: Duration, x: Vector4<f64>, u: f64) -> Vector4<f64> {
        let timestep = format!("timestep=\"{}\"", step.as_secs_f64());
        let xml = include_str!("../cartpole.xml").replace("timestep=\"0.01\"", &timestep);
        let model = MjModel::from_xml_string(&xml).expect("model");
        let mut data = MjData::try_new(Arc::new(model)).expect("memory");
        data.qpos_mut().copy_from_slice(&[x[0], x[1]]);
        data.qvel_mut().copy_from_slice(&[x[2], x[3]]);
        data.ctrl_mut()[0] = u;
        data.step();
        let (qpos, qvel) = (data.qpos(), data.qvel());
        Vector4::new(qpos[0], qpos[1], qvel[0], qvel[1])
    }

    #[test]
    fn a_step_of_any_length_matches_mujoco() {
        let dynamics = Dynamics::cart_pole().expect("plant");
        for milliseconds in [1, 2, 5, 10] {
            let step = Duration::from_millis(milliseconds);
            let LinearPlant { a, b } = dynamics.step(step);
            for axis in 0..4 {
                let x = Vector4::ith(axis, SMALL);
                let apart = (mujoco(step, x, 0.0) - a * x).amax();
                assert!(apart < 1e-8 * SMALL, "{milliseconds} ms, {axis}: {apart}");
            }
            let apart = (mujoco(step, Vector4::zeros(), SMALL) - b * SMALL).amax();
            assert!(apart < 1e-8 * SMALL, "{milliseconds} ms, action: {apart}");
        }
    }
}
