//! Turns, logs and gates: a run on threads comes back in any schedule.

use std::sync::atomic::{AtomicUsize, Ordering};

use ratelab::{Clock, Graph, Match, Shared, Tick, Time, Topic};
use ratelab_metrics::{Observer, TapHandle};
use ratelab_re_execution::RunLog;
use ratelab_real_clock::RealClock;
use shuttle::{sync::Arc, thread};

use crate::{
    SOME, explore,
    support::{depth, re_execution_of, reader, run_timed, snapshot},
};

/// Two nodes that count their ticks, add to a shared number and publish the sum, one that
/// reads it, and one that it triggers.
fn graph() -> (Graph, Topic<u64>) {
    let mut graph = Graph::new();
    let ticks = Arc::new(Shared::new("ticks", 0));
    let total = Arc::new(Shared::new("total", 0));
    let topic = Topic::new("/sum", depth(2));
    for (name, rate) in [("a", 100.0), ("b", 50.0)] {
        let (ticks, total) = (ticks.clone(), total.clone());
        let added = graph.node(name, rate, 0, |wiring| {
            let sum = wiring.publisher(&topic);
            move |tick: &mut Tick| {
                // Another thread may come between this and the rest.
                *ticks.lock() += 1;
                let mut total = total.lock();
                *total += 1;
                // One lock within the other.
                tick.publish(&sum, *total);
            }
        });
        added.expect("node");
    }
    reader(&mut graph, "c", 70.0, 0, &topic);
    // Its thread may get a message before it has started.
    let added = graph.node("d", Match::Each, 0, |wiring| {
        let mut sum = wiring.trigger(&topic);
        let ticks = ticks.clone();
        move |tick: &mut Tick| {
            let read = tick.read(&mut sum);
            *ticks.lock() += read.expect("the message that it is for").data;
        }
    });
    added.expect("node");
    (graph, topic)
}

/// Every message, and the losses of the reader.
fn run(clock: &mut dyn Clock, commands: &str) -> (Graph, Vec<(u64, u64, Time)>, u64) {
    let (mut graph, topic) = graph();
    let tap = TapHandle::new(&graph).topic(&topic, 1_000);
    RunLog::attach(&graph.state());
    run_timed(clock, &mut graph, commands, Time::from_nanos(60_000_000));
    let messages = tap.items().try_iter();
    let messages = messages.map(|tapped| (tapped.message.data, tapped.message.seq, tapped.head.at));
    let messages = messages.collect();
    let dropped = snapshot(&graph).topics[0].dropped();
    (graph, messages, dropped)
}

fn comes_back(perturb: bool) {
    explore(SOME, move || {
        let commands = "0.02 rate a 80; 0.02 depth /sum 1";
        let (first, messages, dropped) = run(&mut RealClock::default(), commands);
        let state = first.state();
        let mut re_execution = re_execution_of(&Observer::new(&first));
        if perturb {
            re_execution.perturb();
        }
        let again = run(&mut re_execution, "");
        assert_eq!(re_execution.difference(), None);
        assert_eq!((again.1, again.2), (messages, dropped));
        assert_eq!(again.0.state().events(0), state.events(0));
    });
}

#[test]
fn a_run_comes_back_by_its_plan_in_every_schedule() {
    comes_back(false);
}

#[test]
fn a_run_comes_back_by_its_gates_in_every_schedule() {
    comes_back(true);
}

#[test]
fn an_overlap_that_is_held_does_no_operation_before_it_is_allowed_in_every_schedule() {
    static OVERLAPS: AtomicUsize = AtomicUsize::new(0);
    explore(SOME, || {
        let (first, messages, _) = run(&mut RealClock::default(), "");
        let mut re_execution = re_execution_of(&Observer::new(&first));
        let Some(last) = re_execution.overlaps().len().checked_sub(1) else {
            return;
        };
        OVERLAPS.fetch_add(1, Ordering::Relaxed);
        let operations = re_execution.overlaps()[last].operations.len();
        re_execution.hold(last, 0);
        let watch = re_execution.watch();
        let again = thread::spawn(move || run(&mut re_execution, "").1);
        for allowed in (0..operations).step_by(2).chain([operations]) {
            watch.allow(allowed);
            let done = loop {
                match watch.held() {
                    Some(done) => break done,
                    None => thread::yield_now(),
                }
            };
            // All of it, where a node is held within a lock that another one needs.
            assert!(done == allowed || done == operations, "{done} of {allowed}");
        }
        watch.end();
        let again = again.join().expect("no panic");
        assert_eq!(watch.difference(), None);
        assert_eq!(messages.get(..again.len()), Some(&again[..]));
    });
    assert!(
        OVERLAPS.load(Ordering::Relaxed) > 0,
        "no schedule had an overlap"
    );
}
