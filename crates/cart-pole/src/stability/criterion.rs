//! The disturbances of a loop, and the cost of its deviations.

use crate::{CART_LIMIT_M, POLE_LIMIT_RAD};

/// Random disturbance of a loop, white and with mean zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Noise {
    /// Intensity of the disturbance added to the action in force (actions² · s): over a
    /// time `t` its integral has the variance `intensity · t`. In a world of steps it is
    /// constant during each.
    pub push: f64,
    /// Variance of the error of each coordinate in a reading: cart position
    /// (m²), pole angle (rad²), cart velocity (m²/s²), pole velocity (rad²/s²).
    pub reading: [f64; 4],
}

/// The cost of a deviation per second: the sum of weighted squares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    /// Weights of cart position (1/m²), pole angle (1/rad²), cart velocity (s²/m²) and
    /// pole velocity (s²/rad²).
    pub state: [f64; 4],
    /// Weight of the action in force.
    pub action: f64,
}

impl Default for Weights {
    /// The weights of the regulator `lqr`: each of cart position, pole angle and action
    /// costs 1 per second at the limit of a lost run or at the motor's full force.
    fn default() -> Self {
        Self {
            state: [CART_LIMIT_M.powi(-2), POLE_LIMIT_RAD.powi(-2), 0.0, 0.0],
            action: 1.0,
        }
    }
}
