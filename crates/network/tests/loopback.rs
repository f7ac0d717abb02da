//! Two parts of a graph, connected over loopback.

mod support;

use std::{sync::Arc, thread};

use ratelab_cart_pole::CartPole;
use ratelab_experiment::{Config, Experiment, Summary};
use ratelab_metrics::Snapshot;
use ratelab_network::{Bridge, key::Keys};
use ratelab_real_clock::RealClock;
use ratelab_system::System;
use support::{address, connect, graph, listen, part, until_met};
use zenoh::Wait;

/// A part of a run after its end.
struct Ended {
    summary: Summary,
    snapshot: Snapshot,
    bridge: Bridge,
}

/// Runs `system` in two parts, of which the first listens, with `ros` also in that domain.
fn run(system: Arc<dyn System>, parts: [&[&str]; 2], ros: Option<u32>) -> [Ended; 2] {
    let address = address();
    let ends = [listen(&address, None), connect(&address, None)];
    let [one, other] = [0, 1].map(|end| part(system.clone(), parts[end], &ends[end], ros));
    until_met(&one.1, &other.1);
    let runs = [one, other].map(|(part, bridge)| {
        thread::spawn(move || {
            let observer = part.observer();
            let summary = part.run_with(&mut RealClock::default()).expect("a run");
            let snapshot = observer.snapshot();
            Ended {
                summary,
                snapshot,
                bridge,
            }
        })
    });
    runs.map(|run| run.join().expect("a thread"))
}

#[test]
fn a_policy_in_another_process_balances_and_nothing_is_lost_with_ros_and_without() {
    for ros in [None, Some(0)] {
        let parts: [&[&str]; 2] = [&["sensor", "actuator"], &["policy"]];
        let mut runs = (0..5).map(|_| run(Arc::new(CartPole::default()), parts, ros));
        // On a busy machine the pole may fall.
        let both = runs.find(|[plant, _]| plant.summary.verdict.name() == "balanced");
        let both = both.unwrap_or_else(|| panic!("it fell each time, {ros:?}"));
        for inlet in both.iter().flat_map(|part| part.bridge.inlets()) {
            let (sender, hostile) = (inlet.sender(), inlet.refused.hostile());
            let counts = (sender.lost, sender.starts, hostile);
            assert_eq!(counts, (0, 1, 0), "{} {ros:?}", inlet.name);
        }
        let [plant, policy] = both.map(|part| part.summary);
        assert!(plant.topic("/action").expect("a topic").published > 50);
        assert!(policy.topic("/obs").expect("a topic").published > 50);
        // The age of the sensing goes around through both.
        assert!(plant.latency.count() > 50, "{:?}", plant.latency);
    }
}

/// A number a thousand times a second, and a reader that takes five times as long.
const FLOOD: &str = "
    name = 'flood'
    node.source = { rate = 1000, publishes = ['/numbers'] }
    node.slow = { rate = 200, reads = ['/numbers'] }
";

#[test]
fn a_reader_that_is_too_slow_reads_fresh_messages_and_counts_the_others() {
    let [_, slow] = run(graph(FLOOD), [&["source"], &["slow"]], None);
    let numbers = slow.snapshot.topic("/numbers").expect("read there");
    let (published, dropped) = (numbers.published, numbers.dropped());
    assert!(dropped > published / 2, "{dropped} of {published}");
    // In a queue most would be older than half a second. Two periods of the reader are 10 ms,
    // and some more on a busy machine.
    let p50 = numbers.readers[0].ages.quantile(0.5);
    let p50 = p50.expect("messages were read");
    assert!(p50.as_millis() < 200, "{p50:?}");
}

/// Two sensors whose clocks are wrong in their stamps, as the graph has it.
const WRONG_CLOCKS: &str = "
    name = 'wrong-clocks'
    node.ahead = { rate = 50, stamp_clock = '180 20', publishes = ['/ahead'] }
    node.behind = { rate = 50, stamp_clock = '-180 0', publishes = ['/behind'] }
    node.both = { trigger = ['/ahead', '/behind'] }
";

#[test]
fn stamps_that_the_graph_makes_wrong_are_refused_by_no_process() {
    let parts: [&[&str]; 2] = [&["ahead", "behind"], &["both"]];
    let [_, reader] = run(graph(WRONG_CLOCKS), parts, None);
    for inlet in reader.bridge.inlets() {
        assert_eq!(inlet.refused.hostile(), 0, "{}", inlet.name);
        let topic = reader.snapshot.topic(&inlet.name).expect("read there");
        assert!(topic.published > 50, "{}: {}", inlet.name, topic.published);
    }
}

#[test]
fn a_process_that_is_refused_was_never_present() {
    let address = address();
    let [listen, connect] = [listen(&address, None), connect(&address, None)];
    let [plant, policy]: [&[&str]; 2] = [&["sensor", "actuator"], &["policy"]];
    let system: Arc<dyn System> = Arc::new(CartPole::default());
    let (_plant, there) = part(system.clone(), plant, &listen, None);
    let (_policy, here) = part(system.clone(), policy, &connect, None);
    until_met(&there, &here);
    let (session, keys) = (connect.open().expect("anybody"), Keys::new(system.name()));
    let watched = session.liveliness().declare_subscriber(keys.processes());
    let present = watched.wait().expect("a subscriber");
    let plant: Vec<String> = plant.iter().map(|&node| node.to_owned()).collect();
    for _ in 0..20 {
        let second = Experiment::part(system.clone(), &Config::default(), &plant).expect("a part");
        let joined = Bridge::start(&connect, &second, &plant, None).map(drop);
        let why = joined.expect_err("it is taken").to_string();
        assert!(why.contains("sensor and actuator run already"), "{why}");
    }
    // Presences come in order: that of a process which was refused would be the first.
    let last = keys.process(0);
    let token = session.liveliness().declare_token(&last).wait();
    let _token = token.expect("a presence");
    let first = present.recv().expect("a presence");
    assert_eq!(first.key_expr().as_str(), last);
}
