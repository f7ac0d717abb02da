//! The product over one hyper-period, and its eigenvalues.

use std::time::Duration;

use nalgebra::{Complex, ComplexField, DMatrix, Schur};

use super::{
    control_loop::{Loop, StabilityError, WorldModel},
    frequency::Passage,
    timing::Rates,
};
use crate::policy::Scripted;

/// Maximum number of rounds until the multipliers converge. A 4×4 matrix takes about ten.
const ROUNDS: usize = 1_000;

/// Number of squarings; each halves the remaining error.
const SQUARINGS: u32 = 50;

/// Stability of a loop by linear theory.
#[derive(Clone, Debug, PartialEq)]
pub struct Stability {
    /// The time `T` after which the schedule repeats.
    pub hyper_period: Duration,
    /// Age of the reading behind the action in force, averaged over time.
    pub mean_push_age: Duration,
    /// The monodromy matrix divided by `e^log_scale`.
    scaled: DMatrix<f64>,
    log_scale: f64,
    /// The logarithm of the largest modulus of the multipliers.
    log_radius: f64,
}

impl Stability {
    /// Stability of the scripted balancer's loop at `rates` in the course's world, in
    /// exact time.
    ///
    /// # Errors
    /// [`StabilityError`], usually because the hyper-period is longer than
    /// [`LONGEST`](super::LONGEST).
    pub fn for_rates(rates: Rates) -> Result<Self, StabilityError> {
        Loop::cart_pole(Scripted::GAINS, WorldModel::Course, rates)?.stability()
    }

    /// Returns the Floquet multipliers, the one with the largest modulus first. Infinite where a
    /// deviation overflows within one hyper-period; [`growth`](Self::growth) stays finite. Includes
    /// the multipliers of actions stored from one hyper-period to the next; empty if their
    /// computation does not converge.
    pub fn multipliers(&self) -> Vec<Complex<f64>> {
        let schur = Schur::try_new(self.scaled.clone(), f64::EPSILON, ROUNDS);
        let scaled = schur.iter().flat_map(|schur| {
            let eigenvalues = schur.complex_eigenvalues();
            eigenvalues.iter().copied().collect::<Vec<_>>()
        });
        let scale = self.log_scale.exp();
        let mut multipliers: Vec<_> = scaled.map(|scaled| scaled * scale).collect();
        multipliers.sort_by(|a, b| b.modulus().total_cmp(&a.modulus()));
        multipliers
    }

    /// Returns the factor by which a deviation grows in one hyper-period, in the long run: the
    /// largest modulus of the multipliers.
    pub fn spectral_radius(&self) -> f64 {
        self.log_radius.exp()
    }

    /// Returns the rate at which a small deviation grows in the long run (1/s); negative if it
    /// shrinks.
    pub fn growth(&self) -> f64 {
        self.log_radius / self.hyper_period.as_secs_f64()
    }

    /// Returns whether small deviations shrink. An unstable loop may still keep the pole up, with a
    /// limited oscillation.
    pub fn is_stable(&self) -> bool {
        self.log_radius < 0.0
    }
}

impl Loop {
    /// Computes the stability of small deviations, in exact time.
    ///
    /// # Errors
    /// [`StabilityError`], usually because the hyper-period is longer than
    /// [`LONGEST`](super::LONGEST).
    pub fn stability(&self) -> Result<Stability, StabilityError> {
        let (passage, schedule) = Passage::new(self)?;
        let (scaled, log_scale) = product(&passage);
        Ok(Stability {
            hyper_period: schedule.period,
            mean_push_age: Duration::from_secs_f64(schedule.mean_age),
            log_radius: log_spectral_radius(scaled.clone()) + log_scale,
            scaled,
            log_scale,
        })
    }
}

/// Returns the effect of a passage on the loop's state as a linear map, divided by `e^s`, together
/// with `s`, which keeps the numbers finite.
fn product(passage: &Passage) -> (DMatrix<f64>, f64) {
    let mut states = DMatrix::identity(passage.size(), passage.size());
    let mut log_scale = 0.0;
    for event in &passage.events {
        passage.happen(*event, &mut states);
        let size = states.amax();
        if !(1e-100..1e100).contains(&size) {
            states /= size;
            log_scale += size.ln();
        }
    }
    (states, log_scale)
}

/// Returns the logarithm of the largest modulus of the eigenvalues of `matrix`, from the size of
/// its powers: Gelfand's formula, which needs no iteration for eigenvalues and therefore always
/// converges. Minus infinity if a power is zero.
pub(super) fn log_spectral_radius(mut matrix: DMatrix<f64>) -> f64 {
    let (mut log_radius, mut weight) = (0.0, 1.0);
    for _ in 0..SQUARINGS {
        let size = matrix.amax();
        if size == 0.0 {
            return f64::NEG_INFINITY;
        }
        log_radius += size.ln() * weight;
        matrix /= size;
        matrix = &matrix * &matrix;
        weight /= 2.0;
    }
    log_radius
}
