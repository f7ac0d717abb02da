//! The discrete algebraic Riccati equation.

use nalgebra::{Matrix4, Vector4};

/// Maximum number of doublings until convergence. Each squares the remaining error; about
/// a dozen is usual.
const ROUNDS: usize = 60;

/// Relative change that counts as converged.
const STILL: f64 = 1e-14;

/// The stabilising solution X of `X = AᵀXA − AᵀXB (R + BᵀXB)⁻¹ BᵀXA + Q`, by the
/// structure-preserving doubling algorithm: after `k` rounds `h` is the cost of the best
/// `2ᵏ` decisions. `None` if it does not converge.
///
/// Source: Chu, Fan, Lin and Wang, *Structure-preserving algorithms for periodic
/// discrete-time algebraic Riccati equations*, Int. J. Control 77 (2004).
pub(super) fn solve_riccati(
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
