//! The controller that is made from the model: best over the next five seconds.

use nalgebra::DMatrix;

use crate::{
    linear::LinearRobot,
    rounding::{digit, rounded},
};

/// The time that the best decisions cover at least (s).
const HORIZON_S: f64 = 5.0;

/// Returns the first gain of the best decisions, every `period_s`, where deviations cost `q` and
/// controls
/// `r`; `None` where it cannot be computed.
///
/// A round doubles the number of decisions: the structure-preserving doubling algorithm.
///
/// Source: Chu, Fan, Lin and Wang, *Structure-preserving algorithms for periodic
/// discrete-time algebraic Riccati equations*, Int. J. Control 77 (2004).
pub(crate) fn gains(
    robot: &LinearRobot,
    [q, r]: [&[f64]; 2],
    period_s: f64,
) -> Option<DMatrix<f64>> {
    let LinearRobot { a: motion, b } = robot;
    let diagonal = |weights: &[f64]| DMatrix::from_diagonal(&weights.to_vec().into());
    let one_over: Vec<f64> = r.iter().map(|weight| 1.0 / weight).collect();
    let identity = DMatrix::identity(motion.nrows(), motion.ncols());
    let (mut a, mut g, mut h) = (
        motion.clone(),
        b * diagonal(&one_over) * b.transpose(),
        diagonal(q),
    );
    let mut decisions = 1.0;
    while decisions * period_s < HORIZON_S {
        let inverse = (&identity + &g * &h).try_inverse()?;
        let more = a.transpose() * &h * &inverse * &a;
        let through = &a * inverse;
        let further = &through * &g * a.transpose();
        // Symmetric, but for rounding.
        h += (&more + more.transpose()) / 2.0;
        g += (&further + further.transpose()) / 2.0;
        a = through * a;
        decisions *= 2.0;
    }
    let weighted = b.transpose() * &h;
    let inverse = (diagonal(r) + &weighted * b).try_inverse()?;
    let gains = inverse * weighted * motion;
    let greatest = gains.amax();
    if !greatest.is_finite() || greatest == 0.0 {
        return (greatest == 0.0).then_some(gains);
    }
    let exponent = digit(greatest, 5);
    Some(gains.map(|gain| rounded(gain, exponent)))
}
