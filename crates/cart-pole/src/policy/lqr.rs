//! Linear feedback with optimal gains.

use nalgebra::{Matrix4, RowVector1, RowVector4, Vector4};
use ratelab::Hz;
use thiserror::Error;

use super::{Policy, built_in::feedback};
use crate::{
    Action, CART_LIMIT_M, CONTROL_HZ, LinearPlant, Observation, POLE_LIMIT_RAD, PlantError,
};

/// The largest action, which costs as much as the largest deviations: the full force of
/// the motor.
const ACTION_LIMIT: f64 = 1.0;

/// Maximum number of doublings until convergence. Each squares the remaining error; about
/// a dozen is usual.
const ROUNDS: usize = 60;

/// Relative change that counts as converged.
const STILL: f64 = 1e-14;

/// The linear-quadratic regulator: the linear feedback that minimises `Σ xᵀ·Q·x + u·R·u`
/// over all future decisions.
///
/// Near upright the plant is `x' = A·x + B·u` from one decision to the next
/// ([`LinearPlant`]). The plant moves in whole control steps of 20 ms. An action is held
/// for the number of steps nearest to the control period, at least one; A and B cover
/// that many steps. With `X` the solution of the discrete algebraic Riccati equation
///
/// ```text
/// X = AᵀXA − AᵀXB (R + BᵀXB)⁻¹ BᵀXA + Q
/// ```
///
/// the action is `u = −(R + BᵀXB)⁻¹ BᵀXA · x`.
///
/// Q and R follow Bryson's rule: one over the square of the largest acceptable value,
/// which is the limit of a lost run (2.4 m, 0.2095 rad) and the motor's full force (1);
/// velocities have no cost of their own.
///
/// A policy receives observations but no rates: the gains are computed for the initial
/// control rate of its run, and stay the same when that rate changes.
///
/// Sources: Anderson and Moore, *Optimal Control: Linear Quadratic Methods*,
/// chapter 2; Bryson and Ho, *Applied Optimal Control*, section 5.2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lqr {
    gains: [f64; 4],
}

/// An error while computing the regulator.
#[derive(Clone, Debug, Error)]
pub enum LqrError {
    /// Linearising the plant failed.
    #[error("the plant cannot be linearised: {0}")]
    Plant(#[from] PlantError),
    /// Solving the Riccati equation failed.
    #[error(
        "no solution of the Riccati equation was found for a policy at {0}: \
         try a higher control rate"
    )]
    Riccati(Hz),
}

impl Lqr {
    /// Computes the regulator for a policy that decides at `control_hz`.
    ///
    /// # Errors
    /// [`LqrError`] if MuJoCo cannot linearise the plant, or without a solution: at
    /// very low rates the deviation between two decisions grows beyond the range of
    /// numbers.
    pub fn at(control_hz: Hz) -> Result<Self, LqrError> {
        let steps = (CONTROL_HZ / control_hz.get()).round().max(1.0);
        let plant = LinearPlant::control_step()?.held_for(steps as u32);
        let gains = gains(&plant).ok_or(LqrError::Riccati(control_hz))?;
        Ok(Self { gains })
    }

    /// Returns the gains in the order of the plant's state: cart position (1/m), pole angle
    /// (1/rad), cart velocity (s/m), pole velocity (s/rad). The action is their sum of products
    /// with the state, before clipping.
    pub fn gains(&self) -> [f64; 4] {
        self.gains
    }
}

fn gains(plant: &LinearPlant) -> Option<[f64; 4]> {
    let LinearPlant { a, b } = plant;
    let most = Vector4::new(CART_LIMIT_M, POLE_LIMIT_RAD, f64::INFINITY, f64::INFINITY);
    // The result of `powf` in the C library matches the compiler's constant folding; that
    // of `powi` differs in the last bit, which would make a run differ between two
    // builds.
    let weight = |most: f64| most.powf(-2.0);
    let q = Matrix4::from_diagonal(&most.map(weight));
    let r = RowVector1::new(weight(ACTION_LIMIT));
    let x = solve_riccati(a, b, &q, r[0])?;
    let feedback: RowVector4<f64> =
        -(r + b.transpose() * x * b).try_inverse()? * b.transpose() * x * a;
    let finite = feedback.iter().all(|gain| gain.is_finite());
    finite.then(|| feedback.into())
}

/// Returns the stabilising solution X of `X = AᵀXA − AᵀXB (R + BᵀXB)⁻¹ BᵀXA + Q`, by the
/// structure-preserving doubling algorithm: after `k` rounds `h` is the cost of the best `2ᵏ`
/// decisions. `None` if it does not converge.
///
/// Source: Chu, Fan, Lin and Wang, *Structure-preserving algorithms for periodic
/// discrete-time algebraic Riccati equations*, Int. J. Control 77 (2004).
fn solve_riccati(
    a: &Matrix4<f64>,
    b: &Vector4<f64>,
    q: &Matrix4<f64>,
    r: f64,
) -> Option<Matrix4<f64>> {
    let (mut a, mut g, mut h) = (*a, b * b.transpose() / r, *q);
    for _ in 0..ROUNDS {
        let inverse = (Matrix4::identity() + g * h).try_inverse()?;
        let more = a.transpose() * h * inverse * a;
        (g, h) = (g + a * inverse * g * a.transpose(), h + more);
        a = a * inverse * a;
        if !h.iter().all(|entry| entry.is_finite()) {
            return None;
        }
        if more.amax() <= STILL * h.amax() {
            return Some((h + h.transpose()) / 2.0);
        }
    }
    None
}

impl Policy for Lqr {
    fn name(&self) -> &str {
        "lqr"
    }

    fn act(&mut self, observation: &Observation) -> Action {
        feedback(&self.gains, observation)
    }
}
