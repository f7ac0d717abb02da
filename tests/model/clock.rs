//! The real clock: every tick, command, end and fault is accounted for.

use std::sync::Mutex;

use ratelab::{
    Clock, ClockExit, ClockKind, Command, Fault, Flow, Graph, Inbox, Node, NodeError, Tick,
    TickResult, Time, Topic, run,
};
use ratelab_metrics::TapHandle;
use ratelab_real_clock::RealClock;
use shuttle::sync::Arc;

use crate::{
    SOME, explore, person,
    support::{applied, command, depth, hz, seqs, snapshot, worker},
};

/// Ticks of three nodes under the real clock, as the nodes saw them.
struct Trio {
    graph: Graph,
    topics: Vec<Topic<u64>>,
    starts: Arc<Mutex<Vec<Vec<Time>>>>,
}

const NAMES: [&str; 3] = ["a", "b", "c"];

/// Slow enough that a node waits at times: the checker's schedules are unfair, and a node
/// that never waits may keep all others from running.
const RATES: [f64; 3] = [100.0, 50.0, 20.0];

/// Fast enough that nodes are late, for runs that end by themselves.
const BUSY: [f64; 3] = [500.0, 200.0, 50.0];

/// Ticks like a closure, and accepts every message.
struct Obedient<F>(F);

impl<F: Node> Node for Obedient<F> {
    fn tick(&mut self, tick: &mut Tick) -> TickResult {
        self.0.tick(tick)
    }

    fn on_order(&mut self, _: &str) -> Result<String, NodeError> {
        Ok("silence".to_owned())
    }
}

/// Each node publishes; the last one ends the run at `end`.
fn trio(rates: [f64; 3], end: Time) -> Trio {
    let mut graph = Graph::new();
    // A lock outside of the checker: recording a tick is not part of the model.
    let starts = Arc::new(Mutex::new(vec![Vec::new(); NAMES.len()]));
    let mut topics = Vec::new();
    for (index, (name, rate)) in NAMES.into_iter().zip(rates).enumerate() {
        let topic = Topic::new(format!("/{name}"), depth(1));
        let starts = starts.clone();
        let added = graph.node(name, hz(rate), 0, |wiring| {
            let publisher = wiring.publisher(&topic);
            Obedient(move |tick: &mut Tick| {
                let now = tick.now();
                starts.lock().expect("starts")[index].push(now);
                tick.publish(&publisher, 0);
                if index == 2 && now >= end {
                    Flow::End
                } else {
                    Flow::Continue
                }
            })
        });
        added.expect("node");
        topics.push(topic);
    }
    Trio {
        graph,
        topics,
        starts,
    }
}

impl Trio {
    /// Runs under the real clock while another thread sends `commands`, and checks what must hold
    /// in any order.
    fn run(&mut self, commands: &'static str, until: Time) -> Result<ClockExit, Fault> {
        let taps = TapHandle::new(&self.graph);
        let taps: Vec<_> = self
            .topics
            .iter()
            .map(|topic| taps.topic(topic, 1_000))
            .collect();
        let (commander, mut inbox) = Inbox::new(Vec::new());
        let person = person(commander, commands);
        let real = &mut RealClock::default();
        let exit = run(&mut self.graph, &mut inbox, until, ClockKind::Real, real);
        let ended = snapshot(&self.graph);
        person.join().expect("person");
        for (index, tap) in taps.iter().enumerate() {
            let (seqs, ticks) = (seqs(tap), ended.nodes[index].ticks);
            assert_eq!(seqs, Vec::from_iter(0..ticks), "{}", NAMES[index]);
            assert_eq!(ended.topics[index].published, ticks);
        }
        let after = snapshot(&self.graph).nodes;
        let pairs = after.iter().zip(&ended.nodes);
        pairs.for_each(|(after, node)| assert_eq!(after.ticks, node.ticks));
        self.check_resumptions();
        exit
    }

    /// Checks that run time continues after all earlier events.
    fn check_resumptions(&self) {
        let events = applied(&self.graph.state().events(0));
        let mut latest = Time::ZERO;
        for (at, command) in events {
            assert!(command != Command::Resume || at >= latest, "back to {at:?}");
            latest = latest.max(at);
        }
    }

    /// Checks that a node with a constant rate ticked at most once in each of its
    /// periods.
    fn check_periods(&self, index: usize) {
        let period = hz(RATES[index]).period().as_nanos();
        let starts = &self.starts.lock().expect("starts")[index];
        let number = |start: &Time| start.since(Time::ZERO).as_nanos() / period;
        let apart = starts.is_sorted_by(|a, b| number(a) < number(b));
        assert!(apart, "two ticks in a period: {starts:?}");
    }
}

fn milliseconds(milliseconds: u64) -> Time {
    Time::from_nanos(milliseconds * 1_000_000)
}

#[test]
fn the_real_clock_reaches_its_end_with_every_period_accounted_for() {
    explore(SOME, || {
        let (mut trio, until) = (trio(RATES, Time::MAX), milliseconds(60));
        let exit = trio.run("", until).expect("run");
        assert_eq!(exit, ClockExit::Completed);
        let nodes = snapshot(&trio.graph).nodes;
        for (index, node) in nodes.iter().enumerate() {
            let period = node.hz.period().as_nanos() as u64;
            let periods = until.as_nanos() / period + 1;
            let (ticks, overruns) = (node.ticks, node.overruns);
            assert!(ticks + overruns >= periods, "{ticks} of {periods}");
            trio.check_periods(index);
        }
    });
}

#[test]
fn every_command_that_was_given_before_a_stop_takes_effect() {
    const COMMANDS: &str = "rate a 40; depth /a 3; send b one; pause; rate b 75; send c two; \
        resume; rate a 110; stop";
    explore(SOME, || {
        let mut trio = trio(RATES, Time::MAX);
        let exit = trio.run(COMMANDS, Time::MAX).expect("run");
        assert_eq!(exit, ClockExit::Stopped);
        let applied = applied(&trio.graph.state().events(0));
        for command in COMMANDS.split("; ").map(command) {
            let times = applied.iter().filter(|(_, applied)| *applied == command);
            assert_eq!(times.count(), 1, "{command} in {applied:?}");
        }
        trio.check_periods(2);
    });
}

#[test]
fn a_stop_ends_an_endless_wait() {
    explore(SOME, || {
        let mut graph = Graph::new();
        worker(&mut graph, "sleeper", 0.001, 0, |_: &mut Tick| {});
        let (commander, mut inbox) = Inbox::new(Vec::new());
        let person = person(commander, "stop");
        let exit = RealClock::default().run(&mut graph, &mut inbox, Time::MAX);
        assert_eq!(exit.expect("run"), ClockExit::Stopped);
        person.join().expect("person");
    });
}

#[test]
fn a_node_that_ends_the_run_ends_it_through_pauses_and_hand_overs() {
    explore(SOME, || {
        let mut trio = trio(RATES, milliseconds(20));
        let commands = "pause; resume; virtual; real; pause; resume";
        let exit = trio.run(commands, Time::MAX).expect("run");
        assert!(
            matches!(&exit, ClockExit::Ended { node, .. } if node == "c"),
            "{exit:?}"
        );
        let starts = trio.starts.lock().expect("starts");
        let after_the_end = starts[2].iter().filter(|start| **start >= milliseconds(20));
        assert_eq!(after_the_end.count(), 1, "it ticked on after the end");
    });
}

#[test]
fn a_graph_that_is_handed_over_loses_and_doubles_no_tick() {
    explore(SOME, || {
        let (mut trio, until) = (trio(BUSY, Time::MAX), milliseconds(80));
        let commands = "virtual; rate b 90; real; depth /c 2; virtual";
        let exit = trio.run(commands, until).expect("run");
        assert_eq!(exit, ClockExit::Completed);
        let all_starts = trio.starts.lock().expect("starts");
        for index in [0, 2] {
            let node = &snapshot(&trio.graph).nodes[index];
            let period = node.hz.period().as_nanos() as u64;
            assert!(node.ticks + node.overruns > until.as_nanos() / period);
            // Virtual time stands still between a tick that is late from the real clock
            // and one that is due at that moment.
            let in_time = |start: &Time| start.as_nanos().is_multiple_of(period);
            let starts = &all_starts[index];
            assert!(
                starts.is_sorted_by(|a, b| a < b || (a == b && in_time(b))),
                "a burst: {starts:?}"
            );
        }
    });
}

#[test]
fn a_fault_is_reported_through_a_pause() {
    explore(SOME, || {
        let mut graph = Graph::new();
        // It fails only once, so a missed fault would not recur.
        let mut sound = true;
        worker(&mut graph, "sick", 100.0, 0, move |tick: &mut Tick| {
            let now = tick.now();
            if now < milliseconds(10) || !std::mem::take(&mut sound) {
                return Ok(Flow::Continue);
            }
            Err("broken".into())
        });
        worker(&mut graph, "well", 70.0, 0, |_: &mut Tick| {});
        let (commander, mut inbox) = Inbox::new(Vec::new());
        let person = person(commander, "pause; resume; pause; resume");
        let fault = RealClock::default().run(&mut graph, &mut inbox, milliseconds(100));
        assert_eq!(fault.expect_err("a fault").node, "sick");
        person.join().expect("person");
    });
}
