//! Short names for graphs of the core, and nodes that record their ticks.
#![allow(dead_code)] // Each test uses its own part.

use std::sync::{Arc, Mutex};

use crossbeam_channel::Receiver;
use ratelab::{
    Clock, ClockExit, Command, Depth, Event, EventKind, GO_ON, Graph, Hz, Inbox, Knob, Message,
    Payload, Tick, Time, TimedCommand, Topic, VirtualClock,
};
use ratelab_account::{Observer, Tap, TapMessage};
use ratelab_replay::{Rerun, RunLog};

/// A valid rate.
pub fn hz(hz: f64) -> Hz {
    Hz::new(hz).expect("a rate")
}

/// A valid depth.
pub fn depth(messages: usize) -> Depth {
    Depth::new(messages).expect("a depth")
}

/// The run time `seconds`.
pub fn secs(seconds: f64) -> Time {
    Time::from_secs_f64(seconds).expect("a time")
}

/// `command` at the run time `seconds`.
pub fn at(seconds: f64, command: Command) -> TimedCommand {
    let at = secs(seconds);
    TimedCommand { at, command }
}

pub fn set_rate(node: &str, rate: f64) -> Command {
    let (node, hz) = (node.to_owned(), hz(rate));
    Command::Set(Knob::Rate { node, hz })
}

pub fn set_depth(topic: &str, messages: usize) -> Command {
    let (topic, depth) = (topic.to_owned(), depth(messages));
    Command::Set(Knob::Depth { topic, depth })
}

/// Sends `text` to `node`.
pub fn send_to(node: &str, text: &str) -> Command {
    let (node, text) = (node.to_owned(), text.to_owned());
    Command::Set(Knob::Send { node, text })
}

/// Adds a node that publishes what it `says` in a tick.
pub fn talker<T: Payload>(
    graph: &mut Graph,
    name: &str,
    rate: f64,
    priority: u32,
    topic: &Topic<T>,
    mut says: impl FnMut(Time) -> Option<T> + Send + 'static,
) {
    let added = graph.node(name, rate, priority, |wiring| {
        let publisher = wiring.publisher(topic);
        move |now| {
            if let Some(word) = says(now) {
                publisher.publish(word, now, None);
            }
            GO_ON
        }
    });
    added.expect(name);
}

/// Adds a node that reads `topic`; the newest message of each tick, with the run time.
pub fn reader<T: Payload>(
    graph: &mut Graph,
    name: &str,
    rate: f64,
    priority: u32,
    topic: &Topic<T>,
) -> Receiver<(Time, Message<T>)> {
    let (sender, read) = crossbeam_channel::unbounded();
    let added = graph.node(name, rate, priority, |wiring| {
        let mut messages = wiring.subscription(topic);
        move |now| {
            if let Some(message) = messages.latest(now) {
                let _ = sender.send((now, message));
            }
            GO_ON
        }
    });
    added.expect(name);
    read
}

/// The messages of a tap so far.
pub fn tapped<T>(tap: &Tap<TapMessage<T>>) -> Vec<Message<T>> {
    let items = tap.items().try_iter();
    items.map(|tapped| tapped.message).collect()
}

/// The run that `observer` saw and that has a log, to be executed again.
pub fn rerun_of(observer: &Observer) -> Rerun {
    let log = RunLog::of(observer).log();
    Rerun::new(&log, &observer.events(0), &observer.topology()).expect("a log")
}

/// Runs `graph` with these commands only, and observes it.
pub fn run_timed(
    clock: &mut impl Clock,
    graph: &mut Graph,
    timed: Vec<TimedCommand>,
    until: Time,
) -> ClockExit {
    let (_, mut inbox) = Inbox::new(timed);
    Observer::of(graph);
    clock.run(graph, &mut inbox, until).expect("no fault")
}

/// The same on the virtual clock.
pub fn run_virtual(graph: &mut Graph, timed: Vec<TimedCommand>, until: Time) -> ClockExit {
    run_timed(&mut VirtualClock, graph, timed, until)
}

/// The commands of a run that took effect, with their times.
pub fn applied(events: &[Event]) -> Vec<(Time, Command)> {
    let applied = events.iter();
    let applied = applied.filter_map(|event| Some((event.at, event.applied()?.clone())));
    applied.collect()
}

/// The refused commands of a run, with the reasons.
pub fn refused(events: &[Event]) -> Vec<(Command, String)> {
    let refused = events.iter().filter_map(|event| match &event.what {
        EventKind::Refused { command, reason } => Some((command.clone(), reason.clone())),
        _ => None,
    });
    refused.collect()
}

/// The ticks of all nodes so far.
pub fn ticks(observer: &Observer) -> u64 {
    observer
        .snapshot()
        .nodes
        .iter()
        .map(|node| node.ticks)
        .sum()
}

/// The ticks of nodes, in their order.
#[derive(Clone, Default)]
pub struct TickLog(Arc<Mutex<Vec<(&'static str, Time)>>>);

impl TickLog {
    /// Adds a node that only records its ticks.
    pub fn node(&self, graph: &mut Graph, name: &'static str, rate: f64, priority: u32) {
        self.node_that(graph, name, rate, priority, |_| GO_ON);
    }

    /// Adds a node that records its ticks and then works.
    pub fn node_that(
        &self,
        graph: &mut Graph,
        name: &'static str,
        rate: f64,
        priority: u32,
        mut work: impl FnMut(Time) -> Tick + Send + 'static,
    ) {
        let log = self.0.clone();
        let node = move |now| {
            log.lock().expect("log").push((name, now));
            work(now)
        };
        let added = graph.node(name, hz(rate), priority, |_| node);
        added.expect("a name of its own");
    }

    /// All ticks so far.
    pub fn all(&self) -> Vec<(&'static str, Time)> {
        self.0.lock().expect("log").clone()
    }

    /// The ticks of the node called `name`.
    pub fn of(&self, name: &str) -> Vec<Time> {
        let all = self.all();
        let its = all.iter().filter(|(node, _)| *node == name);
        its.map(|(_, at)| *at).collect()
    }
}

/// One node at 10 Hz.
pub fn metronome() -> (TickLog, Graph) {
    let (log, mut graph) = (TickLog::default(), Graph::new());
    log.node(&mut graph, "a", 10.0, 0);
    (log, graph)
}
