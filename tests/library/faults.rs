//! A fault is an error: it ends the run and names the failed node, the run time and the
//! cause.

use ratelab::{
    Clock, Event, EventKind, Fault, GO_ON, Graph, Inbox, Panicked, Tick, Time, VirtualClock,
};
use ratelab_cart_pole::{Action, NotFinite, Observation, POLICY, Plant, policy::Policy};
use ratelab_effects::Effects;
use ratelab_real_clock::RealClock;
use ratelab_study::experiment::{Config, Experiment};

use crate::support::{TickLog, secs, with_policy};

/// The fault of a graph whose second node runs `work` from 0.02 s on.
fn fault_of(clock: &mut dyn Clock, work: fn() -> Tick) -> (Fault, Vec<Event>) {
    let (log, mut graph) = (TickLog::default(), Graph::with(Effects));
    log.node(&mut graph, "healthy", 100.0, 0);
    log.node_that(&mut graph, "sick", 100.0, 1, move |now| {
        if now < secs(0.02) { GO_ON } else { work() }
    });
    let fault = clock
        .run(&mut graph, &mut Inbox::default(), Time::MAX)
        .expect_err("a fault");
    assert_eq!(log.of("sick").last(), Some(&fault.at));
    (fault, graph.state().events(0))
}

fn check_fault(work: fn() -> Tick, cause: &str) -> Fault {
    let (fault, events) = fault_of(&mut RealClock::default(), work);
    assert!(fault.at >= secs(0.02));
    let node = "sick".to_owned();
    let what = EventKind::Faulted {
        node,
        cause: cause.to_owned(),
    };
    assert_eq!(events, [Event { at: fault.at, what }]);
    let (fault, _) = fault_of(&mut VirtualClock, work);
    let expected = format!("node \"sick\" failed at 0.020 s: {cause}");
    assert_eq!(fault.to_string(), expected);
    fault
}

#[test]
fn a_node_that_returns_an_error_gives_a_fault_with_its_name_and_the_time() {
    check_fault(|| Err("out of cheese".into()), "out of cheese");
}

#[test]
fn a_node_that_panics_gives_a_fault_with_its_name_and_the_time() {
    let fault = check_fault(|| panic!("no {}", "brakes"), "it panicked: no brakes");
    assert!(fault.cause.is::<Panicked>());
}

/// Returns the same action for every observation.
#[derive(Clone)]
struct Stubborn(f32);

impl Policy for Stubborn {
    fn name(&self) -> &str {
        "stubborn"
    }

    fn act(&mut self, _: &Observation) -> Action {
        Action(self.0)
    }
}

#[test]
fn a_policy_that_answers_no_number_gives_a_fault_with_its_name_and_its_observation() {
    for answer in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let stubborn = Experiment::new(with_policy(Stubborn(answer)), &Config::default());
        let fault = stubborn.expect("experiment").run().expect_err("a fault");
        assert_eq!((fault.node.as_str(), fault.at), (POLICY, Time::ZERO));
        assert!(fault.cause.is::<NotFinite>());
        let start = Plant::new(0).expect("plant").observe();
        for part in ["stubborn", &answer.to_string(), &format!("{start:?}")] {
            assert!(fault.to_string().contains(part), "{fault} lacks {part}");
        }
    }
}
