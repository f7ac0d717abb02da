//! Short names for graphs of the core, and nodes that record their ticks.
#![allow(dead_code)] // Each test uses its own part.

use std::sync::{Arc, Mutex};

use crossbeam_channel::Receiver;
use ratelab::{
    Clock, ClockExit, ClockKind, Command, Depth, Event, EventKind, Flow, Graph, Hz, Inbox, Match,
    Message, Node, Payload, Speed, Tick, Time, TimedCommand, Topic, VirtualClock,
};
use ratelab_metrics::{Lineage, Observer, Snapshot, Tap, TapMessage, TickRecord};
use ratelab_re_execution::{ReExecution, RunLog};
use ratelab_real_clock::RealClock;

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

/// The command `text`: `pause`, `resume`, `step`, `stop`, a speed such as `speed 2`, the clock to
/// go on under, or a knob.
pub fn command(text: &str) -> Command {
    if let Some(times) = text.strip_prefix("speed ") {
        return Command::Speed(Speed::times(times.parse().expect(text)).expect(text));
    }
    match text {
        "pause" => Command::Pause,
        "resume" => Command::Resume,
        "step" => Command::Step,
        "stop" => Command::Stop,
        "real" => Command::HandOver(ClockKind::Real),
        "virtual" => Command::HandOver(ClockKind::Virtual),
        knob => Command::Set(knob.parse().expect(knob)),
    }
}

/// Commands at run times (s), such as `0.1 rate a 20; 0.2 stop`.
pub fn timed(list: &str) -> Vec<TimedCommand> {
    let commands = list
        .split(';')
        .map(str::trim)
        .filter(|text| !text.is_empty())
        .map(|text| {
            let (seconds, text) = text.split_once(' ').expect("a time");
            let (at, command) = (secs(seconds.parse().expect(seconds)), command(text));
            TimedCommand { at, command }
        });
    commands.collect()
}

/// `knobs` at the beginning of a run.
pub fn at_once(knobs: &str) -> String {
    knobs
        .split(';')
        .filter(|knob| !knob.trim().is_empty())
        .map(|knob| format!("0 {};", knob.trim()))
        .collect()
}

/// Both clocks.
pub fn clocks() -> [Box<dyn Clock>; 2] {
    [Box::new(VirtualClock), Box::<RealClock>::default()]
}

/// Adds a node that does `work` in each tick.
pub fn worker(graph: &mut Graph, name: &str, rate: f64, priority: u32, work: impl Node + 'static) {
    graph.node(name, rate, priority, |_| work).expect(name);
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
        move |tick: &mut Tick| {
            let now = tick.now();
            if let Some(word) = says(now) {
                tick.publish(&publisher, word);
            }
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
        move |tick: &mut Tick| {
            let now = tick.now();
            if let Some(message) = tick.read(&mut messages) {
                let _ = sender.send((now, message));
            }
        }
    });
    added.expect(name);
    read
}

/// Adds a node that each message on `topic` triggers; returns the times of its ticks.
pub fn triggered<T: Payload>(
    graph: &mut Graph,
    name: &str,
    priority: u32,
    topic: &Topic<T>,
) -> Receiver<Time> {
    let (sender, ticks) = crossbeam_channel::unbounded();
    let added = graph.node(name, Match::Each, priority, |wiring| {
        let _ = wiring.trigger(topic);
        move |tick: &mut Tick| {
            let now = tick.now();
            sender.send(now)?;
            Ok(Flow::Continue)
        }
    });
    added.expect(name);
    ticks
}

/// The messages of a tap so far.
pub fn tapped<T>(tap: &Tap<TapMessage<T>>) -> Vec<Message<T>> {
    let items = tap.items().try_iter();
    items.map(|tapped| tapped.message).collect()
}

/// The sequence numbers of the messages of a tap so far.
pub fn seqs<T>(tap: &Tap<TapMessage<T>>) -> Vec<u64> {
    tapped(tap).iter().map(|message| message.seq).collect()
}

/// The figures of `graph`.
pub fn snapshot(graph: &Graph) -> Snapshot {
    Observer::new(graph).snapshot()
}

/// The events of `graph` so far, as text.
pub fn events(graph: &Graph) -> Vec<String> {
    let events = graph.state().events(0);
    events.iter().map(ToString::to_string).collect()
}

/// More than any topic publishes or any node ticks in a test.
pub const ROOM: usize = 20_000;

/// `lineage` with these ticks, too.
pub fn settled(mut lineage: Lineage, ticks: &[Tap<TickRecord>]) -> Lineage {
    for (node, ticks) in ticks.iter().enumerate() {
        ticks
            .items()
            .try_iter()
            .for_each(|tick| lineage.tick(node, tick));
    }
    lineage.settle();
    lineage
}

/// The run that `observer` saw and that has a log, to be executed again.
pub fn re_execution_of(observer: &Observer) -> ReExecution {
    let log = RunLog::attach(observer).log();
    ReExecution::new(&log, &observer.events(0), &observer.topology()).expect("a log")
}

/// Runs `graph` with these commands only, and observes it.
pub fn run_timed(
    clock: &mut dyn Clock,
    graph: &mut Graph,
    commands: &str,
    until: Time,
) -> ClockExit {
    let (_, mut inbox) = Inbox::new(timed(commands));
    Observer::new(graph);
    clock.run(graph, &mut inbox, until).expect("no fault")
}

/// Runs `graph` on the virtual clock.
pub fn run_virtual(graph: &mut Graph, commands: &str, until: Time) -> ClockExit {
    run_timed(&mut VirtualClock, graph, commands, until)
}

/// The commands of a run that took effect, with their times.
pub fn applied(events: &[Event]) -> Vec<(Time, Command)> {
    let applied = events
        .iter()
        .filter_map(|event| Some((event.at, event.applied()?.clone())));
    applied.collect()
}

/// Why commands of a run were refused.
pub fn refused(events: &[Event]) -> Vec<String> {
    let refused = events.iter().filter_map(|event| match &event.what {
        EventKind::Refused { reason, .. } => Some(reason.clone()),
        _ => None,
    });
    refused.collect()
}

/// The ticks of all nodes so far.
pub fn ticks(observer: &Observer) -> u64 {
    let snapshot = observer.snapshot();
    snapshot.nodes.iter().map(|node| node.ticks).sum()
}

/// The ticks of nodes, in their order.
#[derive(Clone, Default)]
pub struct TickLog(Arc<Mutex<Vec<(&'static str, Time)>>>);

impl TickLog {
    /// Adds a node that only records its ticks.
    pub fn node(&self, graph: &mut Graph, name: &'static str, rate: f64, priority: u32) {
        self.node_that(graph, name, rate, priority, |_: &mut Tick| {});
    }

    /// Adds a node that records its ticks and then works.
    pub fn node_that(
        &self,
        graph: &mut Graph,
        name: &'static str,
        rate: f64,
        priority: u32,
        mut work: impl Node + 'static,
    ) {
        let log = self.0.clone();
        worker(graph, name, rate, priority, move |tick: &mut Tick| {
            log.lock().expect("log").push((name, tick.now()));
            work.tick(tick)
        });
    }

    /// All ticks so far.
    pub fn all(&self) -> Vec<(&'static str, Time)> {
        self.0.lock().expect("log").clone()
    }

    /// The ticks of the node called `name`.
    pub fn ticks(&self, name: &str) -> Vec<Time> {
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
