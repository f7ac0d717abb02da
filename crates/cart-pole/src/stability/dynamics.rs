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
    /// Creates the dynamics of the cart-pole, from one physics step of MuJoCo.
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
