//! How a run ends: its verdict names the kind of loss, and a fault names the failed node, the run
//! time and the cause.

use crate::support::*;

#[test]
fn a_cart_that_leaves_the_rail_with_the_pole_up_is_not_a_pole_that_fell() {
    // Balances the pole at an angle away from upright, which accelerates the cart.
    let lean = |seen: &Observation| {
        let theta = f64::from(seen.sin_theta).atan2(f64::from(seen.cos_theta));
        (10.0 * (theta - 0.05) + 2.0 * f64::from(seen.pole_velocity)) as f32
    };
    let summary = run_of(with_policy(lean), &Config::default());
    assert_eq!(
        summary.verdict.kind,
        ratelab_cart_pole::verdict::CART_LEFT_RAIL
    );
    assert_eq!(summary.verdict.at, summary.sim_time);
    assert!(pole_angle(&summary.state).abs() < POLE_LIMIT_RAD);
    assert!(summary.verdict.is_lost());
    let printed = summary.verdict.to_string();
    assert!(
        printed.contains(&CART_LIMIT_M.to_string()) && !printed.contains("FELL"),
        "{printed}"
    );
}

#[test]
fn an_unattended_pole_falls() {
    for kind in ["zero", "random"] {
        let summary = run(&config(&format!("policy {kind}")));
        check(kind, &summary, "verdict pole_fell");
    }
}

/// The fault of a graph whose second node runs `work` from 0.02 s on.
fn check_fault(work: fn() -> TickResult, expected: &str) {
    for mut clock in clocks() {
        let (log, mut graph) = (TickLog::default(), Graph::new());
        log.node(&mut graph, "healthy", 100.0, 0);
        log.node_that(&mut graph, "sick", 100.0, 1, move |tick: &mut Tick| {
            if tick.now() < secs(0.02) {
                Ok(Flow::Continue)
            } else {
                work()
            }
        });
        let fault = clock.run(&mut graph, &mut Inbox::default(), Time::MAX);
        let fault = fault.expect_err("a fault");
        assert_eq!(log.ticks("sick").last(), Some(&fault.at));
        assert!(fault.at >= secs(0.02));
        let (node, cause) = ("sick".to_owned(), expected.to_owned());
        let what = EventKind::Faulted { node, cause };
        let at = fault.at;
        assert_eq!(graph.state().events(0), [Event { at, what }]);
        let said = format!("node \"sick\" failed at {at}: {expected}");
        assert_eq!(fault.to_string(), said);
        let panicked = expected.starts_with("it panicked");
        assert_eq!(fault.cause.is::<Panicked>(), panicked);
    }
}

#[test]
fn a_node_that_fails_gives_a_fault_with_its_name_and_the_time() {
    check_fault(|| Err("out of cheese".into()), "out of cheese");
    check_fault(|| panic!("no {}", "brakes"), "it panicked: no brakes");
}

#[test]
fn a_policy_that_answers_no_number_gives_a_fault_with_its_name_and_its_observation() {
    for answer in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let stubborn = Experiment::new(with_policy(move |_| answer), &Config::default());
        let fault = stubborn.expect("experiment").run().expect_err("a fault");
        assert_eq!((fault.node.as_str(), fault.at), (POLICY, Time::ZERO));
        assert!(fault.cause.is::<NotFinite>());
        let start = Plant::new(0).expect("plant").observe();
        for part in ["own", &answer.to_string(), &format!("{start:?}")] {
            assert!(fault.to_string().contains(part), "{fault} lacks {part}");
        }
    }
}
