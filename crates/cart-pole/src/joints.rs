//! Readings and actions as joint states.

use ratelab_metrics::Fields;
use ratelab_system::{JointValues, Joints};

use super::message::{ACTION, Action, MOTOR_N, OBS, Observation};

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
