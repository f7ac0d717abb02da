//! The product over one hyper-period, and its eigenvalues.

use std::time::Duration;

use nalgebra::{Complex, ComplexField, Matrix4, RowVector4, Schur};
use thiserror::Error;

use super::schedule::{LONGEST, Rates, Stage};
use crate::{
    cartpole::{LinearPlant, PlantError},
    policy::Scripted,
};

/// Rounds after which the eigenvalues must have converged. A 4×4 matrix takes
/// about ten.
const ROUNDS: usize = 1_000;

/// Linear theory of the scripted balancer at some rates.
#[derive(Clone, Debug, PartialEq)]
pub struct Stability {
    /// The time `T` after which the schedule repeats.
    pub hyper_period: Duration,
    /// The eigenvalues of the monodromy matrix divided by `e^log_scale`, the
    /// largest modulus first.
    scaled: [Complex<f64>; 4],
    log_scale: f64,
}

/// A pair of rates about which linear theory is not asked.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum StabilityError {
    /// It takes too long until the schedule repeats.
    #[error(
        "a sensor at {sensor} and a policy at {control} meet the plant only every {seconds} s: \
         linear theory is worked out up to {longest} s; use rates with fewer decimals",
        sensor = rates.sensor, control = rates.control,
        seconds = hyper_period.as_secs_f64(), longest = LONGEST.as_secs()
    )]
    Aperiodic {
        /// The rates.
        rates: Rates,
        /// How long it takes.
        hyper_period: Duration,
    },
    /// The plant could not be linearised.
    #[error("the plant cannot be linearised: {0}")]
    Plant(String),
    /// The eigenvalues did not converge.
    #[error("the eigenvalues at a policy of {} did not converge: try one beside it", .0.control)]
    Eigenvalues(Rates),
}

impl From<PlantError> for StabilityError {
    fn from(error: PlantError) -> Self {
        Self::Plant(error.to_string())
    }
}

impl Stability {
    /// The scripted balancer's loop at `rates`, in exact time.
    ///
    /// # Errors
    /// [`StabilityError`], most likely because the hyper-period is longer than
    /// [`LONGEST`].
    pub fn of(rates: Rates) -> Result<Self, StabilityError> {
        let hyper_period = rates.hyper_period();
        if hyper_period > LONGEST {
            return Err(StabilityError::Aperiodic {
                rates,
                hyper_period,
            });
        }
        let (monodromy, log_scale) = monodromy(rates, &LinearPlant::control_step()?);
        let mut scaled: [_; 4] = Schur::try_new(monodromy, f64::EPSILON, ROUNDS)
            .ok_or(StabilityError::Eigenvalues(rates))?
            .complex_eigenvalues()
            .into();
        scaled.sort_by(|a, b| b.modulus().total_cmp(&a.modulus()));
        Ok(Self {
            hyper_period,
            scaled,
            log_scale,
        })
    }

    /// The Floquet multipliers, the one with the largest modulus first.
    /// Infinite where a deviation grows beyond all numbers in one hyper-period,
    /// which [`growth`](Self::growth) is not.
    pub fn multipliers(&self) -> [Complex<f64>; 4] {
        self.scaled.map(|scaled| scaled * self.log_scale.exp())
    }

    /// The factor by which a deviation grows in one hyper-period, in the long
    /// run: the largest modulus of the multipliers.
    pub fn spectral_radius(&self) -> f64 {
        self.log_radius().exp()
    }

    /// The rate at which a small deviation grows in the long run (1/s);
    /// negative if it shrinks.
    pub fn growth(&self) -> f64 {
        self.log_radius() / self.hyper_period.as_secs_f64()
    }

    /// Whether small deviations shrink. That is less than it sounds: an
    /// unstable loop may still keep the pole up, by swinging.
    pub fn is_stable(&self) -> bool {
        self.log_radius() < 0.0
    }

    fn log_radius(&self) -> f64 {
        self.scaled[0].modulus().ln() + self.log_scale
    }
}

/// The plant's state after one hyper-period as a linear map of the state
/// before, divided by `e^s`; and `s`, which keeps the numbers finite.
fn monodromy(rates: Rates, plant: &LinearPlant) -> (Matrix4<f64>, f64) {
    let gains = RowVector4::from(Scripted::GAINS);
    // Each as a linear map of the plant's state at the start.
    let mut state = Matrix4::identity();
    let mut reading = Matrix4::zeros();
    let mut action = RowVector4::zeros();
    let mut log_scale = 0.0;
    for tick in rates.ticks() {
        match tick {
            Stage::Sense => reading = state,
            Stage::Decide => action = gains * reading,
            Stage::Act => state = plant.a * state + plant.b * action,
        }
        let size = state.amax();
        if !(1e-100..1e100).contains(&size) {
            (state, reading, action) = (state / size, reading / size, action / size);
            log_scale += size.ln();
        }
    }
    (state, log_scale)
}
