//! An executor under the real clock: its threads take turns in any schedule, and lose nothing.

use ratelab::{
    Callback, Clock, ClockExit, ClockKind, Executor, Flow, Graph, Inbox, Match, Tick, Time, Topic,
    run,
};
use ratelab_metrics::{Observer, TapHandle, TickRecord};
use ratelab_re_execution::RunLog;
use ratelab_real_clock::RealClock;
use shuttle::{
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
};

use crate::{
    SOME, explore, person,
    support::{depth, re_execution_of, run_timed, snapshot, talker, worker},
};

const EXECUTORS: [&str; 3] = ["single", "multi:2", "events"];

const UNTIL: Time = Time::from_nanos(60_000_000);

/// A source on a thread of its own; a sink of its messages, a second one that excludes the
/// first, and a timer, on the threads of an executor.
fn graph(executor: Executor) -> Graph {
    let mut graph = Graph::new();
    let topic = Topic::new("/messages", depth(2));
    talker(&mut graph, "source", 100.0, 0, &topic, |_| Some(0_u64));
    let most = executor.shares().expect("one with threads");
    let all = Arc::new(AtomicUsize::new(0));
    let grouped = Arc::new(AtomicUsize::new(0));
    for name in ["sink", "second"] {
        let (all, grouped) = (all.clone(), grouped.clone());
        let added = graph.node(name, Match::Each, 0, |wiring| {
            let mut messages = wiring.trigger(&topic);
            move |tick: &mut Tick| {
                assert!(
                    all.fetch_add(1, Ordering::SeqCst) < most,
                    "too many threads"
                );
                assert_eq!(grouped.fetch_add(1, Ordering::SeqCst), 0, "both of a group");
                assert!(
                    tick.read(&mut messages).is_some(),
                    "a tick without a message"
                );
                thread::yield_now();
                grouped.fetch_sub(1, Ordering::SeqCst);
                all.fetch_sub(1, Ordering::SeqCst);
            }
        });
        added.expect("node");
    }
    worker(&mut graph, "timer", 50.0, 0, move |_: &mut Tick| {
        assert!(
            all.fetch_add(1, Ordering::SeqCst) < most,
            "too many threads"
        );
        thread::yield_now();
        all.fetch_sub(1, Ordering::SeqCst);
    });
    let callbacks = ["sink", "second"].map(|name| Callback::new(name).in_group("group"));
    let timer = Callback::new("timer");
    let added = graph.executor(executor, callbacks.into_iter().chain([timer]));
    added.expect("nodes");
    graph
}

fn executors(check: impl Fn(Executor) + Send + Sync + Clone + 'static) {
    for executor in EXECUTORS {
        let (executor, check) = (executor.parse().expect("a text"), check.clone());
        explore(SOME, move || check(executor));
    }
}

#[test]
fn every_message_is_taken_dropped_or_waits_and_no_due_time_is_called_twice() {
    executors(|executor| {
        let mut graph = graph(executor);
        let exit = run_timed(&mut RealClock::default(), &mut graph, "", UNTIL);
        assert_eq!(exit, ClockExit::Completed);
        let snapshot = snapshot(&graph);
        let topic = &snapshot.topics[0];
        for (sink, subscription) in snapshot.nodes[1..3].iter().zip(&topic.readers) {
            let left = topic.published - sink.ticks - subscription.dropped;
            assert!(left <= 2, "{left} of {} left", topic.published);
        }
        // Due at 20, 40 and 60 ms; the clock of the checker may be past all of them at once.
        assert!(snapshot.nodes[3].ticks <= 3, "a due time was called twice");
    });
}

#[test]
fn commands_and_the_other_clock_leave_no_thread_behind() {
    executors(|executor| {
        let mut graph = graph(executor);
        let (commander, mut inbox) = Inbox::new(Vec::new());
        let commands =
            "crash sink; rate timer 70; pause; restart sink; resume; virtual; real; stop";
        let person = person(commander, commands);
        let real = &mut RealClock::default();
        let exit = run(&mut graph, &mut inbox, Time::MAX, ClockKind::Real, real);
        assert_eq!(exit.expect("run"), ClockExit::Stopped);
        person.join().expect("person");
    });
}

#[test]
fn a_message_wakes_a_thread_that_waits_for_nothing_else() {
    for executor in EXECUTORS {
        let executor: Executor = executor.parse().expect("a text");
        // Fair schedules: the source goes on until the sink has both.
        let check = move || {
            let mut graph = Graph::new();
            let topic = Topic::new("/messages", depth(1));
            let taken = Arc::new(AtomicUsize::new(0));
            let sink = taken.clone();
            let source = graph.node("source", 100.0, 0, |wiring| {
                let publisher = wiring.publisher(&topic);
                let mut published = 0;
                move |tick: &mut Tick| {
                    if taken.load(Ordering::SeqCst) >= 2 {
                        return Flow::End;
                    }
                    // The second message comes when the thread waits again.
                    if published <= taken.load(Ordering::SeqCst) {
                        published += 1;
                        tick.publish(&publisher, 0_u64);
                    }
                    Flow::Continue
                }
            });
            source.expect("node");
            let sink = graph.node("sink", Match::Each, 0, |wiring| {
                let _messages = wiring.trigger(&topic);
                move |_: &mut Tick| {
                    sink.fetch_add(1, Ordering::SeqCst);
                }
            });
            sink.expect("node");
            let added = graph.executor(executor, [Callback::new("sink")]);
            added.expect("a node");
            let exit = run_timed(&mut RealClock::default(), &mut graph, "", Time::MAX);
            assert!(matches!(exit, ClockExit::Ended { .. }));
        };
        shuttle::check_random(check, SOME);
    }
}

/// Every tick of every node of a run.
fn ticks(graph: &mut Graph, clock: &mut dyn Clock) -> Vec<Vec<TickRecord>> {
    let taps = TapHandle::new(graph).ticks(1_000);
    RunLog::attach(&graph.state());
    assert_eq!(run_timed(clock, graph, "", UNTIL), ClockExit::Completed);
    let ticks = taps.iter().map(|tap| tap.items().try_iter().collect());
    ticks.collect()
}

#[test]
fn the_ticks_of_its_threads_come_back_with_their_overruns_in_every_schedule() {
    executors(|executor| {
        let mut first = graph(executor);
        let recorded = ticks(&mut first, &mut RealClock::default());
        let mut re_execution = re_execution_of(&Observer::new(&first));
        let again = ticks(&mut graph(executor), &mut re_execution);
        assert_eq!(re_execution.difference(), None);
        assert_eq!(again, recorded);
    });
}
