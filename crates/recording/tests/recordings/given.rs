//! Runs made by hand: a recorder gets ticks and events that no graph has made.

use std::{path::Path, sync::Arc};

use ratelab::{ClockKind, Event, EventKind, Match, NodeTopology, Speed, Status, Time, Topology};
use ratelab_experiment::Config;
use ratelab_metrics::{Copies, ReplayAccounts, RunRow, Tap, TickRecord};
use ratelab_recording::{Origin, Recorder, Recording, Source, StopReason, Tapped};
use ratelab_system::{Builder, Setup, System};

use super::{Made, file, hz, read, to};

/// A run without topics.
pub struct GivenRun<'a> {
    pub clock: ClockKind,
    /// Its knobs at the start.
    pub setup: &'a str,
    pub nodes: Vec<NodeTopology>,
    /// Its ticks, each with the index of its node.
    pub ticks: Vec<(usize, TickRecord)>,
    pub events: Vec<Event>,
    pub end: Time,
}

/// A node of 50 Hz.
pub fn node(name: &str) -> NodeTopology {
    NodeTopology {
        name: name.to_owned(),
        priority: 1,
        hz: hz(50.0),
        meters: Vec::new(),
        triggers: Vec::new(),
        matching: Match::Each,
        executor: None,
        executor_index: None,
        group: None,
    }
}

struct GivenRows(Copies<RunRow>);

impl Tapped for GivenRows {
    fn fields(&self, _: &str) -> Option<&[String]> {
        None
    }

    fn all(&self, capacity: usize) -> Tap<RunRow> {
        self.0.tap(capacity)
    }
}

impl GivenRun<'_> {
    /// Records it to `path`.
    pub fn record(self, path: &Path) {
        let system: Arc<dyn System> = Arc::new(Made("given", |_: &mut Builder<'_>| Ok(())));
        let knobs = self.setup.split_terminator(", ");
        let config = Config {
            clock: self.clock,
            setup: knobs
                .map(|knob| knob.parse().expect("a knob"))
                .collect::<Setup>(),
            ..Config::default()
        };
        let topology = Topology {
            nodes: self.nodes,
            topics: Vec::new(),
        };
        let status = Status {
            clock: self.clock,
            paused: false,
            speed: Speed::Unlimited,
        };
        let mut accounts = ReplayAccounts::new(&topology, status);
        let (observer, rows) = (accounts.observer(), Arc::new(GivenRows(Copies::default())));
        let source = Source {
            origin: Origin::new(&*system, config, topology),
            start: observer.snapshot(),
            observer,
            taps: rows.clone(),
            system,
            notice: |_| {},
        };
        let recorder = Recorder::from_the_start(&mut to(path), &source).expect("a recorder");
        self.events.iter().for_each(|event| accounts.event(event));
        let ticks = self.ticks.into_iter();
        ticks.for_each(|(node, tick)| rows.0.offer(&RunRow::Tick(node, tick)));
        accounts.set_now(self.end);
        recorder.end(StopReason::Fault("it is over".to_owned()));
        recorder.finish().expect("recorded");
    }

    /// Its recording.
    pub fn recorded(self) -> Recording {
        let (_folder, path) = file("given.rrd");
        self.record(&path);
        read(&path)
    }
}

#[test]
fn events_of_different_threads_keep_their_order() {
    let event = |at| Event {
        at: Time::from_nanos(at),
        what: EventKind::Ended {
            node: "actuator".to_owned(),
        },
    };
    let events = [3, 5, 4, 4, 9, 1].map(event);
    let run = GivenRun {
        clock: ClockKind::Real,
        setup: "",
        nodes: vec![node("actuator")],
        ticks: Vec::new(),
        events: events.to_vec(),
        end: Time::from_nanos(9),
    };
    assert_eq!(run.recorded().events, events);
}
