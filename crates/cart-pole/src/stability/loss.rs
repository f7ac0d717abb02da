//! Mean-square stability under random message loss.

use super::{
    control_loop::Loop,
    covariance::{Covariance, Loss, Lost},
    error::StabilityError,
    passage::Passage,
    spectral::log_spectral_radius,
};

/// Bisection steps over the probability.
const HALVINGS: u32 = 40;

impl Loop {
    /// The rate at which the expected square of a small deviation grows (1/s), with
    /// random loss of messages on `/action`; negative if it shrinks, and then the
    /// deviation shrinks in almost every single run too.
    ///
    /// A jump linear system with independent jumps: the largest modulus of the
    /// eigenvalues of `E[M ⊗ M]`, `M` the product over one hyper-period. Costa,
    /// Fragoso and Marques, *Discrete-Time Markov Jump Linear Systems*, chapter 3.
    ///
    /// # Errors
    /// [`StabilityError`], as for [`Loop::stability`]. The work grows with the sixth
    /// power of the number of readings in flight.
    pub fn mean_square_growth(&self, loss: Loss) -> Result<f64, StabilityError> {
        let (passage, schedule) = Passage::of(self).map_err(|long| self.aperiodic(long))?;
        let squares = Covariance {
            passage: &passage,
            loss,
        };
        Ok(log_spectral_radius(squares.matrix()) / schedule.period.as_secs_f64())
    }

    /// The least probability of loss at which the expected square of a small
    /// deviation does not shrink, by bisection: 0 if it never does, 1 if it
    /// always does.
    ///
    /// # Errors
    /// [`StabilityError`], as for [`Loop::stability`].
    pub fn loss_margin(&self, lost: Lost) -> Result<f64, StabilityError> {
        let shrinks = |probability| {
            let growth = self.mean_square_growth(Loss { probability, lost })?;
            Ok::<_, StabilityError>(growth < 0.0)
        };
        let (mut stable, mut margin) = (0.0, 1.0);
        if !shrinks(stable)? {
            return Ok(stable);
        }
        for _ in 0..HALVINGS {
            let middle = (stable + margin) / 2.0;
            match shrinks(middle)? {
                true => stable = middle,
                false => margin = middle,
            }
        }
        Ok(margin)
    }
}
