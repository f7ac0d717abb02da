//! The plant near upright, linearised.

use std::ptr;

use mujoco_rs::mujoco_c::mjd_transitionFD;
use nalgebra::{Matrix4, Vector4};

use super::{
    body::{PlantError, SUBSTEPS, at_rest},
    plant::STEP,
};

/// Perturbation of each coordinate in the finite differences, in its own unit. The error
/// of centred differences grows with its square, the rounding error with its inverse.
const PERTURBATION: f64 = 1e-6;

/// The motion of a small deviation from upright rest in one step of time: `x' = A·x +
/// B·u`.
///
/// The state `x` is cart position (m), pole angle (rad), cart velocity (m/s) and pole
/// velocity (rad/s), in this order; `u` is an action, held for the whole step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearPlant {
    /// A: the effect of the state.
    pub a: Matrix4<f64>,
    /// B: the effect of the action.
    pub b: Vector4<f64>,
}

impl LinearPlant {
    /// One control step at upright rest: the product of its physics steps.
    ///
    /// # Errors
    /// [`PlantError`] if MuJoCo refuses the model or is out of memory.
    pub fn control_step() -> Result<Self, PlantError> {
        Self::for_model(1.0)
    }

    /// Returns `times` such steps with a constant action; zero counts as one.
    pub fn held_for(self, times: u32) -> Self {
        (1..times).fold(self, |so_far, _| Self {
            a: self.a * so_far.a,
            b: self.a * so_far.b + self.b,
        })
    }

    /// Linearises a plan's model over the time of an action, with a pole `length` times as long.
    pub(crate) fn for_model(length: f64) -> Result<Self, PlantError> {
        Ok(Self::physics_step(length)?.held_for(SUBSTEPS))
    }

    /// One physics step at upright rest with such a pole, by MuJoCo's finite differences.
    pub(super) fn physics_step(length: f64) -> Result<Self, PlantError> {
        let mut data = at_rest(STEP, length)?;
        let model = data.model().ffi();
        let mut a = Matrix4::zeros();
        let mut b = Vector4::zeros();
        // SAFETY: the data was made from the model, and both outlive the call.
        // MuJoCo writes 4×4 and 4×1 numbers for two degrees of freedom, no
        // activation and one control, and skips null outputs.
        unsafe {
            mjd_transitionFD(
                model,
                data.ffi_mut(),
                PERTURBATION,
                true,
                a.as_mut_ptr(),
                b.as_mut_ptr(),
                ptr::null_mut(),
                ptr::null_mut(),
            );
        }
        // MuJoCo writes row by row, nalgebra keeps column by column.
        Ok(Self {
            a: a.transpose(),
            b,
        })
    }
}
