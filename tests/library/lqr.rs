//! The linear-quadratic regulator: its gains are those of another solver.

use crate::support::*;

/// Control steps that an action is held for, and the gains of SciPy's feedback.
fn golden() -> impl Iterator<Item = (f64, Vec<f64>)> {
    let lines = include_str!("../golden/lqr.txt").lines();
    lines.map(fields).map(|fields| {
        let gains = fields["gains"].split(',');
        let gains = gains.map(|gain| gain.parse().expect("a gain"));
        (fields["steps"].parse().expect("steps"), gains.collect())
    })
}

#[test]
fn the_gains_match_another_solver_at_every_control_period() {
    assert_eq!(golden().count(), 6);
    for (steps, gains) in golden() {
        let lqr = Lqr::at(hz(CONTROL_HZ / steps)).expect("gains");
        for (ours, theirs) in lqr.gains().iter().zip(gains) {
            // SciPy's feedback is subtracted, this one is added.
            let error = (ours + theirs).abs() / theirs.abs();
            assert!(error < 1e-8, "{steps} steps: {ours}, expected {}", -theirs);
        }
    }
}

#[test]
fn a_policy_faster_than_the_plant_is_held_for_one_of_its_steps() {
    let at = |rate: f64| Lqr::at(hz(rate)).expect("gains");
    assert_eq!(at(10_000.0), at(CONTROL_HZ));
    assert_eq!(at(60.0), at(CONTROL_HZ));
}

#[test]
fn a_rate_without_a_solution_is_refused() {
    for rate in [0.001, 0.01, 0.1, 0.5, 1.0, 2.0].map(hz) {
        match Lqr::at(rate) {
            Ok(lqr) => assert!(lqr.gains().iter().all(|gain| gain.is_finite())),
            Err(error) => assert!(error.to_string().contains(&rate.to_string()), "{error}"),
        }
    }
}
