//! The policies of a robot that need no file.

use nalgebra::DMatrix;
use ratelab_system::graph_file::PLANT_POLICIES;

use crate::robot::{Robot, SharedRobot};

/// How controls follow from a reading.
#[derive(Clone, Debug)]
pub(crate) enum Law {
    /// Linear feedback with these gains.
    Lqr(DMatrix<f64>),
    /// The controls of the reference, for ever.
    Hold,
    /// None.
    Zero,
}

impl Law {
    /// Returns its name.
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Self::Lqr(_) => PLANT_POLICIES[0],
            Self::Hold => PLANT_POLICIES[1],
            Self::Zero => PLANT_POLICIES[2],
        }
    }

    /// Returns the controls for a reading of `robot`.
    pub(crate) fn controls(&self, robot: &SharedRobot, reading: &[f64]) -> Vec<f64> {
        let at = &robot.at.controls;
        match self {
            Self::Zero => vec![0.0; at.len()],
            Self::Hold => at.clone(),
            Self::Lqr(gains) => robot.fed_back(at, gains, reading),
        }
    }
}

impl Robot {
    /// Returns `controls` with linear feedback on a reading.
    pub(crate) fn fed_back(
        &self,
        controls: &[f64],
        gains: &DMatrix<f64>,
        reading: &[f64],
    ) -> Vec<f64> {
        let state = self.state_in(reading);
        let deviation = self.deviation(state).unwrap_or_default();
        let pairs = controls.iter().zip(gains.row_iter());
        pairs
            .map(|(at, gains)| {
                let products = gains.iter().zip(&deviation).map(|(gain, x)| gain * x);
                at - products.fold(0.0, |sum, product| sum + product)
            })
            .collect()
    }
}
