//! Readings and actions as joint states.

use ratelab_account::Fields;
use ratelab_study::system::{JointValues, Joints};

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readings_and_actions_come_back() {
        let [obs, action] = JOINTS;
        let row = [0.25, -1.5, 0.3_f64.cos(), 0.3_f64.sin(), 2.0];
        let joints = (obs.of_row)(&row).expect("a reading");
        assert!((joints.position[1] - 0.3).abs() < 1e-6, "{joints:?}");
        let back = (obs.to_row)(&joints).expect("a reading");
        assert!(back.iter().zip(row).all(|(a, b)| (a - b).abs() < 1e-6));
        let joints = (action.of_row)(&[-0.5]).expect("an action");
        assert_eq!(joints.effort, [-5.0]);
        assert_eq!((action.to_row)(&joints), Some(vec![-0.5]));
    }

    #[test]
    fn a_force_that_is_none_is_no_action() {
        for effort in [vec![], vec![1.0, 2.0], vec![f64::NAN], vec![f64::INFINITY]] {
            let joints = JointValues {
                effort,
                ..JointValues::default()
            };
            assert_eq!((JOINTS[1].to_row)(&joints), None);
        }
    }
}
