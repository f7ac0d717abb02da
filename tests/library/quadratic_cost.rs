//! The quadratic cost of a run: the mean over run time of the weighted squares of its
//! states, worked out here again from what the run publishes.

use crate::support::*;

/// The cost of a run by its rows: each counts until the next.
fn by_rows(config: &Config) -> (f64, f64) {
    let experiment = experiment(config);
    let tap = experiment.taps().rows(STATE, 1_024).expect(STATE);
    let summary = experiment.run().expect("run");
    let mut rows = tap.rows();
    tap.take(&mut rows);
    let end = summary.sim_time.as_secs_f64();
    let (mut area, mut starts) = (0.0, Vec::new());
    for (place, (head, row)) in rows.iter().enumerate() {
        let start = head.stamp.as_secs_f64();
        let next = rows.heads().get(place + 1);
        let until = next.map_or(end, |head| head.stamp.as_secs_f64());
        let squares = (row[3] / CART_LIMIT_M).powi(2)
            + (pole_angle(row) / POLE_LIMIT_RAD).powi(2)
            + row[1].powi(2);
        area += squares * (until - start);
        starts.push(start);
    }
    (area / (end - starts[0]), summary.cost.expect("a cost"))
}

#[test]
fn it_is_the_mean_of_weighted_squares_over_run_time() {
    for config in [config(""), config("control-hz 5"), own(0, "rate policy 20")] {
        let (expected, cost) = by_rows(&config);
        assert!(
            (cost - expected).abs() < 1e-9 * expected,
            "{cost} {expected}"
        );
    }
}

#[test]
fn a_state_costs_what_its_weights_are_to_the_bit_in_every_build() {
    let cost = CartPole::default()
        .judge()
        .quadratic_cost()
        .expect("a cost");
    let [cart, pole] = [CART_LIMIT_M, POLE_LIMIT_RAD].map(|most| 1.0 / (most * most));
    let at = |cart: f64, hinge: f64| (cost.of_state)(&[0.0, 0.0, 0.0, cart, hinge]);
    let angle = pole_angle(&[0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
    assert_eq!([at(1.0, 0.0), at(0.0, 1.0)], [cart, pole * angle * angle]);
}

#[test]
fn a_state_counts_for_as_long_as_it_is_the_newest() {
    let mut mean = MeanCost::default();
    assert_eq!(mean.until(at_ms(100)), None);
    mean.state(at_ms(100), 4.0);
    assert_eq!(mean.until(at_ms(100)), None);
    mean.state(at_ms(200), 1.0);
    let cost = mean.until(at_ms(500)).expect("time passed");
    assert!((cost - (4.0 * 0.1 + 1.0 * 0.3) / 0.4).abs() < 1e-12);
}

#[test]
fn a_system_that_states_none_has_none() {
    let idle = system(|builder| builder.node("idler", 10.0, 0, |_| |_: &mut Tick| {}));
    assert_eq!(run_of(idle, &Config::default()).cost, None);
}
