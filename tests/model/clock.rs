//! The real clock: every tick, command, end and fault is accounted for.

use std::sync::Mutex;

use ratelab::{
    Clock, ClockExit, ClockKind, Command, END, Fault, GO_ON, Graph, Inbox, Node, Tick, Time, Topic,
    run,
};
use ratelab_account::{Observer, TapHandle};
use ratelab_real_clock::RealClock;
use shuttle::{sync::Arc, thread};

use crate::{
    SOME, explore,
    support::{applied, depth, hz, send_to, set_depth, set_rate},
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

impl<F: FnMut(Time) -> Tick + Send> Node for Obedient<F> {
    fn tick(&mut self, now: Time) -> Tick {
        (self.0)(now)
    }

    fn on_message(&mut self, _: &str) -> Result<String, String> {
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
            Obedient(move |now| {
                starts.lock().expect("starts")[index].push(now);
                publisher.publish(0, now, None);
                if index == 2 && now >= end { END } else { GO_ON }
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
    /// Runs while another thread sends `commands`, and checks what must hold in any
    /// order.
    fn run(
        &mut self,
        first: ClockKind,
        commands: Vec<Command>,
        until: Time,
    ) -> Result<ClockExit, Fault> {
        let taps: Vec<_> = self
            .topics
            .iter()
            .map(|topic| TapHandle::of(&self.graph).topic(topic, 1_000))
            .collect();
        let (commander, mut inbox) = Inbox::new(Vec::new());
        let person = thread::spawn(move || {
            for command in commands {
                thread::yield_now();
                // The run may be over by now.
                let _ = commander.send(command);
            }
        });
        let real = &mut RealClock::default();
        let exit = run(&mut self.graph, &mut inbox, until, first, real);
        let snapshot = Observer::of(&self.graph).snapshot();
        person.join().expect("person");
        for (index, tap) in taps.iter().enumerate() {
            let seqs: Vec<u64> = tap
                .items()
                .try_iter()
                .map(|tapped| tapped.message.seq)
                .collect();
            assert_eq!(
                seqs,
                Vec::from_iter(0..snapshot.nodes[index].ticks),
                "{}",
                NAMES[index]
            );
            assert_eq!(snapshot.topics[index].published, seqs.len() as u64);
        }
        let after = Observer::of(&self.graph).snapshot();
        let ticks = |node: &ratelab_account::NodeAccount| node.ticks;
        assert!(
            after
                .nodes
                .iter()
                .map(ticks)
                .eq(snapshot.nodes.iter().map(ticks))
        );
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
        let periods: Vec<u128> = starts
            .iter()
            .map(|start| start.since(Time::ZERO).as_nanos() / period)
            .collect();
        assert!(
            periods.is_sorted_by(|a, b| a < b),
            "two ticks in a period: {starts:?}"
        );
    }
}

fn milliseconds(milliseconds: u64) -> Time {
    Time::from_nanos(milliseconds * 1_000_000)
}

#[test]
fn the_real_clock_reaches_its_end_with_every_period_accounted_for() {
    explore(SOME, || {
        let (mut trio, until) = (trio(RATES, Time::MAX), milliseconds(60));
        let exit = trio.run(ClockKind::Real, Vec::new(), until).expect("run");
        assert_eq!(exit, ClockExit::Completed);
        let nodes = Observer::of(&trio.graph).snapshot().nodes;
        for (index, node) in nodes.iter().enumerate() {
            let period = node.hz.period().as_nanos() as u64;
            let periods = until.as_nanos() / period + 1;
            assert!(
                node.ticks + node.overruns >= periods,
                "{} of {periods}",
                node.ticks
            );
            trio.check_periods(index);
        }
    });
}

#[test]
fn every_command_that_was_given_before_a_stop_takes_effect() {
    explore(SOME, || {
        let mut trio = trio(RATES, Time::MAX);
        let commands = vec![
            set_rate("a", 40.0),
            set_depth("/a", 3),
            send_to("b", "one"),
            Command::Pause,
            set_rate("b", 75.0),
            send_to("c", "two"),
            Command::Resume,
            set_rate("a", 110.0),
            Command::Stop,
        ];
        let exit = trio
            .run(ClockKind::Real, commands.clone(), Time::MAX)
            .expect("run");
        assert_eq!(exit, ClockExit::Stopped);
        let applied = applied(&trio.graph.state().events(0));
        for command in &commands {
            let times = applied
                .iter()
                .filter(|(_, applied)| applied == command)
                .count();
            assert_eq!(times, 1, "{command} in {applied:?}");
        }
        trio.check_periods(2);
    });
}

#[test]
fn a_stop_ends_an_endless_wait() {
    explore(SOME, || {
        let mut graph = Graph::new();
        graph
            .node("sleeper", hz(0.001), 0, |_| |_| GO_ON)
            .expect("node");
        let (commander, mut inbox) = Inbox::new(Vec::new());
        let person = thread::spawn(move || commander.send(Command::Stop).expect("running"));
        let exit = RealClock::default().run(&mut graph, &mut inbox, Time::MAX);
        assert_eq!(exit.expect("run"), ClockExit::Stopped);
        person.join().expect("person");
    });
}

#[test]
fn a_node_that_ends_the_run_ends_it_through_pauses_and_hand_overs() {
    explore(SOME, || {
        let mut trio = trio(RATES, milliseconds(20));
        let commands = vec![
            Command::Pause,
            Command::Resume,
            Command::HandOver(ClockKind::Virtual),
            Command::HandOver(ClockKind::Real),
            Command::Pause,
            Command::Resume,
        ];
        let exit = trio.run(ClockKind::Real, commands, Time::MAX).expect("run");
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
        let commands = vec![
            Command::HandOver(ClockKind::Virtual),
            set_rate("b", 90.0),
            Command::HandOver(ClockKind::Real),
            set_depth("/c", 2),
            Command::HandOver(ClockKind::Virtual),
        ];
        let exit = trio.run(ClockKind::Real, commands, until).expect("run");
        assert_eq!(exit, ClockExit::Completed);
        let all_starts = trio.starts.lock().expect("starts");
        for index in [0, 2] {
            let node = &Observer::of(&trio.graph).snapshot().nodes[index];
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
        let sick = graph.node("sick", hz(100.0), 0, |_| {
            move |now| {
                if now < milliseconds(10) || !std::mem::take(&mut sound) {
                    return GO_ON;
                }
                Err("broken".into())
            }
        });
        let well = graph.node("well", hz(70.0), 0, |_| |_| GO_ON);
        sick.and(well).expect("nodes");
        let (commander, mut inbox) = Inbox::new(Vec::new());
        let person = thread::spawn(move || {
            for command in [
                Command::Pause,
                Command::Resume,
                Command::Pause,
                Command::Resume,
            ] {
                let _ = commander.send(command);
                thread::yield_now();
            }
        });
        let fault = RealClock::default().run(&mut graph, &mut inbox, milliseconds(100));
        assert_eq!(fault.expect_err("a fault").node, "sick");
        person.join().expect("person");
    });
}
