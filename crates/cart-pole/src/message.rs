//! The messages of the cart-pole, the pose in them, and how similar they are.

use std::{f64::consts::PI, time::Duration};

use ratelab_metrics::Fields;
use ratelab_system::{JointValues, Joints};

use crate::ParameterError;

/// Name of the topic from sensor to policy.
pub const OBS: &str = "/obs";

/// Name of the topic from policy to actuator.
pub const ACTION: &str = "/action";

/// A reading of the sensor, in single precision as a policy network expects it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Cart position on the rail (m).
    pub cart_position: f32,
    /// Cart velocity (m/s).
    pub cart_velocity: f32,
    /// Cosine of the pole's angle; 1 is upright.
    pub cos_theta: f32,
    /// Sine of the pole's angle; positive leans towards +x.
    pub sin_theta: f32,
    /// Pole angular velocity (rad/s).
    pub pole_velocity: f32,
}

impl Observation {
    /// Creates the reading of a perfect sensor at `pose`, cart velocity (m/s) and hinge velocity
    /// (rad/s).
    pub(super) fn new(pose: Pose, [cart_velocity, pole_velocity]: [f64; 2]) -> Self {
        Self {
            cart_position: pose.cart_position as f32,
            cart_velocity: cart_velocity as f32,
            cos_theta: pose.pole_angle.cos() as f32,
            sin_theta: pose.pole_angle.sin() as f32,
            pole_velocity: pole_velocity as f32,
        }
    }

    /// Returns the values in the order of the course: position, velocity, cosine, sine, angular
    /// velocity.
    pub fn to_array(self) -> [f32; 5] {
        [
            self.cart_position,
            self.cart_velocity,
            self.cos_theta,
            self.sin_theta,
            self.pole_velocity,
        ]
    }
}

/// The motor's full force (N).
pub(crate) const MOTOR_N: f64 = 10.0;

/// A force on the cart as a share of the motor's 10 N, positive towards +x. The plant
/// clips it to ±1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Action(pub f32);

impl Action {
    /// No force.
    pub const ZERO: Self = Self(0.0);

    /// Clips the action to the motor's range.
    pub fn clipped(self) -> Self {
        Self(self.0.clamp(-1.0, 1.0))
    }
}

/// The result of one control step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControlStep {
    /// Number of the step, counted from one.
    pub step: u64,
    /// The action as applied, after clipping.
    pub action: Action,
    /// Age of the sensing that the action was derived from; `None` before the
    /// first action.
    pub latency: Option<Duration>,
    /// The reading of a perfect sensor after the step.
    pub observation: Observation,
    /// Cart position (m) and hinge angle (rad, not wrapped) after the step.
    pub qpos: [f64; 2],
    /// Cart velocity (m/s) and hinge velocity (rad/s) after the step.
    pub qvel: [f64; 2],
}

impl Fields for Observation {
    const FIELDS: &'static [&'static str] = &[
        "cart position (m)",
        "cart velocity (m/s)",
        "cos θ",
        "sin θ",
        "pole velocity (rad/s)",
    ];

    fn append_to(&self, row: &mut Vec<f64>) {
        row.extend(self.to_array().map(f64::from));
    }

    fn from_row(row: &[f64]) -> Option<Self> {
        let &[x, v, cos, sin, omega] = row else {
            return None;
        };
        Some(Self {
            cart_position: x as f32,
            cart_velocity: v as f32,
            cos_theta: cos as f32,
            sin_theta: sin as f32,
            pole_velocity: omega as f32,
        })
    }
}

impl Fields for Action {
    const FIELDS: &'static [&'static str] = &["action (share of 10 N)"];

    fn append_to(&self, row: &mut Vec<f64>) {
        row.push(f64::from(self.0));
    }

    fn from_row(row: &[f64]) -> Option<Self> {
        match *row {
            [action] => Some(Self(action as f32)),
            _ => None,
        }
    }
}

impl Fields for ControlStep {
    const FIELDS: &'static [&'static str] = &[
        "step",
        "action (share of 10 N)",
        "latency (ns)",
        "slider position (m)",
        "hinge angle (rad)",
        "slider velocity (m/s)",
        "hinge velocity (rad/s)",
    ];

    /// Whole numbers are exact up to 2⁵³: more steps than any run has, latencies up to
    /// 104 days. NaN stands for no latency. The observation follows from the rest.
    fn append_to(&self, row: &mut Vec<f64>) {
        let latency = self.latency.map(|latency| latency.as_nanos() as f64);
        row.extend([
            self.step as f64,
            f64::from(self.action.0),
            latency.unwrap_or(f64::NAN),
        ]);
        row.extend(self.qpos);
        row.extend(self.qvel);
    }

    fn from_row(row: &[f64]) -> Option<Self> {
        let &[step, action, latency, x, theta, v, omega] = row else {
            return None;
        };
        let (qpos, qvel) = ([x, theta], [v, omega]);
        Some(Self {
            step: step as u64,
            action: Action(action as f32),
            latency: (!latency.is_nan()).then(|| Duration::from_nanos(latency as u64)),
            observation: Observation::new(Pose::new(qpos), qvel),
            qpos,
            qvel,
        })
    }
}

/// `/obs`: cart (m, m/s) and pole (rad from upright, rad/s). `/action`: the force on the
/// cart (N).
pub(super) const JOINTS: [Joints; 2] = [
    Joints {
        topic: OBS,
        names: &["cart", "pole"],
        of_row: |row| {
            let seen = Observation::from_row(row)?;
            let [x, v, cos, sin, omega] = seen.to_array().map(f64::from);
            Some(JointValues {
                position: vec![x, sin.atan2(cos)],
                velocity: vec![v, omega],
                effort: Vec::new(),
            })
        },
        to_row: |joints| {
            let (&[x, angle], &[v, omega]) = (&joints.position[..], &joints.velocity[..]) else {
                return None;
            };
            Some(vec![x, v, angle.cos(), angle.sin(), omega])
        },
    },
    Joints {
        topic: ACTION,
        names: &["cart"],
        of_row: |row| {
            let Action(share) = Action::from_row(row)?;
            Some(JointValues {
                effort: vec![f64::from(share) * MOTOR_N],
                ..JointValues::default()
            })
        },
        to_row: |joints| match joints.effort[..] {
            [force] if force.is_finite() => Some(vec![force / MOTOR_N]),
            _ => None,
        },
    },
];

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

/// Lets a reading pass if it is at least so far from the last one that passed: the Euclidean
/// distance of their five numbers, whatever their units. At 0, the default, all pass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SimilarReadings {
    norm: f64,
    last: Option<Observation>,
}

impl SimilarReadings {
    /// Parses a distance of 0 or more, before the first reading.
    ///
    /// # Errors
    /// [`ParameterError`] for an invalid text.
    pub fn parse(text: &str) -> Result<Self, ParameterError> {
        let norm: Option<f64> = text.trim().parse().ok();
        match norm.filter(|norm| *norm >= 0.0 && norm.is_finite()) {
            Some(norm) => Ok(Self { norm, last: None }),
            None => Err(ParameterError::Distance(text.to_owned())),
        }
    }

    /// Returns the distance below which readings are similar.
    pub fn norm(&self) -> f64 {
        self.norm
    }

    /// Sets the distance; returns the one before.
    pub(super) fn set(&mut self, text: &str) -> Result<String, ParameterError> {
        let norm = Self::parse(text)?.norm;
        Ok(std::mem::replace(&mut self.norm, norm).to_string())
    }

    /// Returns whether `reading` passes.
    pub(super) fn pass(&mut self, reading: &Observation) -> bool {
        let near_last = |last| distance(&last, reading) < self.norm;
        let near = self.norm > 0.0 && self.last.is_some_and(near_last);
        if !near {
            self.last = Some(*reading);
        }
        !near
    }
}

fn distance(one: &Observation, other: &Observation) -> f64 {
    let squares = one
        .to_array()
        .into_iter()
        .zip(other.to_array())
        .map(|(one, other)| {
            let apart = f64::from(one) - f64::from(other);
            apart * apart
        });
    squares.sum::<f64>().sqrt()
}
