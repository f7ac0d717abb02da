//! The messages on the cart-pole's topics: plain data.

use std::time::Duration;

use ratelab_metrics::Fields;

use super::pose::Pose;

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
