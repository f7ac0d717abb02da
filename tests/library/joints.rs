//! Readings and actions as joint states, and back.

use crate::support::*;

/// The joints of the topics with readings and with actions.
fn joints() -> [Joints; 2] {
    let system = cart_pole();
    let all = system.robot().joints();
    [OBS, ACTION].map(|topic| {
        let joints = all.iter().find(|joints| joints.topic == topic);
        *joints.expect(topic)
    })
}

#[test]
fn readings_and_actions_come_back() {
    let [obs, action] = joints();
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
    let [_, action] = joints();
    for effort in [vec![], vec![1.0, 2.0], vec![f64::NAN], vec![f64::INFINITY]] {
        let joints = JointValues {
            effort,
            ..JointValues::default()
        };
        assert_eq!((action.to_row)(&joints), None);
    }
}
