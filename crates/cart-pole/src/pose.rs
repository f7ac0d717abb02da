//! The pose of cart and pole, and the limits of a lost run.

use std::f64::consts::PI;

/// Limit of the pole's angle from upright (rad), beyond which it has fallen: 12 degrees.
pub const POLE_LIMIT_RAD: f64 = 0.2095;

/// Limit of the cart's distance from the middle of the rail (m).
pub const CART_LIMIT_M: f64 = 2.4;

/// The ways to lose a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fall {
    /// The pole tipped beyond [`POLE_LIMIT_RAD`].
    Pole,
    /// The cart went beyond [`CART_LIMIT_M`] with the pole still up.
    Cart,
}

/// The pose of cart and pole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Cart position on the rail (m).
    pub cart_position: f64,
    /// Pole angle from upright (rad), wrapped to −π..π; positive leans
    /// towards +x.
    pub pole_angle: f64,
}

impl Pose {
    /// Creates the pose at cart position (m) and hinge angle (rad).
    pub fn new([cart_position, hinge_angle]: [f64; 2]) -> Self {
        Self {
            cart_position,
            pole_angle: (hinge_angle + PI).rem_euclid(2.0 * PI) - PI,
        }
    }

    /// Returns the kind of fall at this pose, if the run is lost.
    pub fn fall(&self) -> Option<Fall> {
        if self.pole_angle.abs() > POLE_LIMIT_RAD {
            Some(Fall::Pole)
        } else if self.cart_position.abs() > CART_LIMIT_M {
            Some(Fall::Cart)
        } else {
            None
        }
    }
}
