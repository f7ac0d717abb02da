//! The mean cost of deviations, with disturbances and random timing.

use nalgebra::DMatrix;
use ratelab::Time;

use super::{
    control_loop::Loop,
    covariance::{Covariance, Loss, flat, symmetric},
    error::StabilityError,
    passage::{Disturbances, Passage},
    schedule::events,
    span::{Noise, Weights},
    timing::TimedPush,
};

impl Loop {
    /// The expected cost per second of the loop in its steady state, with disturbances
    /// `noise` and random loss of messages on `/action`. `None` if it grows without
    /// bound.
    ///
    /// The covariance of the state passes through the same product of maps as a deviation
    /// in [`Loop::stability`]. Nilsson, *Real-Time Control Systems with Delays* (1998);
    /// Lincoln and Cervin, *Jitterbug*, CDC 2002.
    ///
    /// # Errors
    /// [`StabilityError`], as for [`Loop::stability`].
    pub fn expected_cost(
        &self,
        noise: &Noise,
        weights: &Weights,
        loss: Loss,
    ) -> Result<Option<f64>, StabilityError> {
        let (passage, schedule) = Passage::of(self)?;
        if self.mean_square_growth(loss)? >= 0.0 {
            return Ok(None);
        }
        let covariance = Covariance {
            passage: &passage,
            loss,
        };
        let disturbances = Disturbances::of(&passage, self, noise, weights);
        let size = passage.size();
        // The covariance that disturbances add in one period, and the map of the
        // covariance over a period.
        let mut added = DMatrix::zeros(size, size);
        covariance.cost(&disturbances, &mut added);
        let remembered = covariance.matrix();
        let identity = DMatrix::identity(remembered.nrows(), remembered.ncols());
        let steady = (identity - remembered).lu().solve(&flat(&added));
        Ok(steady.map(|steady| {
            let cost = covariance.cost(&disturbances, &mut symmetric(&steady, size));
            cost / schedule.period.as_secs_f64()
        }))
    }

    /// The expected cost per second, from rest until the last of these pushes is applied,
    /// with disturbances `noise`: for drawn or recorded timing. Each push must be based
    /// on the same reading as the previous one or on a newer one; the loop's own timing
    /// is ignored.
    ///
    /// The method of JitterTime: Cervin, Pazzaglia, Barzegaran and Mahfouzi, *Using
    /// JitterTime to analyze transient performance in adaptive and reconfigurable control
    /// systems*, ETFA 2019.
    pub fn cost_along(&self, pushes: &[TimedPush], noise: &Noise, weights: &Weights) -> f64 {
        let end = pushes.iter().map(|push| push.applied).max();
        let end = end.unwrap_or(Time::ZERO);
        let events = events(pushes, self.world, Time::ZERO, Time::ZERO, end);
        let passage = Passage::through(self, events);
        let disturbances = Disturbances::of(&passage, self, noise, weights);
        let covariance = Covariance {
            passage: &passage,
            loss: Loss::NONE,
        };
        let mut rest = DMatrix::zeros(passage.size(), passage.size());
        covariance.cost(&disturbances, &mut rest) / end.as_secs_f64()
    }
}
