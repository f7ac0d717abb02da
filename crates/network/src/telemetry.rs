//! What processes tell dashboards, as JSON: ticks, messages, arrivals, events; and the commands
//! of dashboards.

use std::{process, time::Duration};

use ratelab::{Command, Event, KnobKind, NodeTopology, Push, Time, TopicTopology, Topology};
use ratelab_experiment::{Config, Experiment};
use ratelab_metrics::{TickCauses, TickRecord};
use serde::{Deserialize, Serialize};

use crate::machine::{self, ClockId, Nanos};

/// What runs in a process.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Info {
    /// Version of ratelab.
    pub ratelab: String,
    /// Another one after each start.
    pub incarnation: u64,
    /// Name of the machine.
    pub host: String,
    /// Number of the process there.
    pub pid: u32,
    /// The command line that starts it again; empty if that is unknown.
    #[serde(default)]
    pub command: String,
    /// Identity of its session, as zenoh prints it.
    #[serde(default)]
    pub session: String,
    /// Whether it listens: run time is its run time, and commands go to it.
    pub is_hub: bool,
    /// Names of the nodes that run there.
    pub nodes: Vec<String>,
    /// Its clock.
    pub clock: ClockId,
    /// Run time zero there, by its clock; `None` before the run.
    pub zero: Option<Nanos>,
    /// The configuration of the run.
    pub config: Config,
    /// The whole graph.
    pub topology: Topology,
    /// The events so far.
    pub events: Vec<Event>,
}

impl Info {
    /// Creates what runs in this process, which has the nodes of `experiment` that are `here`;
    /// without the number that its connection gives.
    pub fn new(experiment: &Experiment, here: &[String]) -> Self {
        let topology = experiment.observer().topology();
        let first = topology.nodes.first();
        Self {
            ratelab: env!("CARGO_PKG_VERSION").to_owned(),
            incarnation: 0,
            host: machine::host(),
            pid: process::id(),
            command: String::new(),
            session: String::new(),
            is_hub: first.is_some_and(|node| here.contains(&node.name)),
            nodes: here.to_vec(),
            clock: ClockId::here(),
            zero: None,
            config: experiment.config().clone(),
            topology,
            events: Vec::new(),
        }
    }

    /// Returns whether a setting of the run makes the clock of a node wrong.
    pub(crate) fn has_wrong_clocks(&self) -> bool {
        let turned = self.config.knobs.iter().map(|timed| &timed.knob);
        self.config
            .setup
            .iter()
            .chain(turned)
            .any(|knob| matches!(knob.kind(), KnobKind::Clock | KnobKind::StampClock))
    }

    /// Returns whether it runs `node`.
    pub fn runs(&self, node: &str) -> bool {
        self.nodes.iter().any(|name| name == node)
    }

    /// Returns its nodes that `other` runs as well.
    pub fn shared(&self, other: &Self) -> Vec<&str> {
        self.nodes
            .iter()
            .map(String::as_str)
            .filter(|node| other.runs(node))
            .collect()
    }

    /// Returns the nodes with these indices in the graph: those that run there, and the others.
    pub(crate) fn split(&self, nodes: &[usize]) -> (Vec<&NodeTopology>, Vec<&NodeTopology>) {
        let nodes = nodes.iter().map(|node| &self.topology.nodes[*node]);
        nodes.partition(|node| self.runs(&node.name))
    }

    /// Returns its nodes that publish to `topic`, if it has a reader elsewhere.
    pub(crate) fn senders(&self, topic: &TopicTopology) -> Vec<&NodeTopology> {
        if self.split(&topic.readers).1.is_empty() {
            Vec::new()
        } else {
            self.split(&topic.publishers).0
        }
    }

    /// Returns its number and its machine.
    pub fn process(&self) -> String {
        format!("process {} on {}", self.pid, self.host)
    }

    /// Returns its nodes, and where they run.
    pub fn place(&self) -> String {
        format!("{} in {}", self.nodes.join(" and "), self.process())
    }
}

/// What happened since the last batch. Times are run times of the process.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Batch {
    /// Number of the batch.
    pub number: u64,
    /// Run time.
    pub now: Time,
    /// Run time zero, by the clock of the process.
    pub zero: Nanos,
    /// Number of the first event here.
    pub first_event: usize,
    /// Events.
    pub events: Vec<Event>,
    /// Ticks by the index of their node.
    pub ticks: Vec<(usize, SentTick)>,
    /// Messages that nodes of the process published.
    pub sent: Vec<PublishedMessage>,
    /// Messages that arrived from other processes, each with the run time of its arrival.
    pub arrived: Vec<(SentMessage, Time)>,
    /// Counters of topics, by their index.
    pub topics: Vec<TopicCounts>,
}

/// A tick.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SentTick {
    number: u64,
    at: Time,
    ends: Option<Time>,
    lateness: Option<Duration>,
    took: Option<Duration>,
    overruns: u64,
    push: Option<(Time, Time)>,
    /// What it read.
    pub reads: Vec<Read>,
    completed: Option<usize>,
}

/// A message, as its sender numbers it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct SentMessage {
    /// Index of its topic.
    pub topic: usize,
    /// The process that sent it.
    pub incarnation: u64,
    /// Position in the topic's history at its sender.
    pub seq: u64,
}

/// A message that a tick read.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Read {
    /// The message.
    pub message: SentMessage,
    /// The reader, by its place at the topic.
    pub reader: usize,
    /// Number of newer messages that were there.
    pub newer: u64,
}

impl SentTick {
    /// Creates a tick of this process that read these messages.
    pub(crate) fn new(tick: &TickRecord, reads: Vec<Read>) -> Self {
        Self {
            number: tick.number,
            at: tick.at,
            ends: tick.ends,
            lateness: tick.lateness,
            took: tick.took,
            overruns: tick.overruns,
            push: tick.push.map(|push| (push.at, push.sensed)),
            reads,
            completed: tick.causes.completed,
        }
    }

    /// Returns the tick with its times converted by `time`, without what it read.
    pub fn record(&self, time: impl Fn(Time) -> Time) -> TickRecord {
        TickRecord {
            number: self.number,
            at: time(self.at),
            ends: self.ends.map(&time),
            lateness: self.lateness,
            took: self.took,
            overruns: self.overruns,
            push: self.push.map(|(at, sensed)| Push {
                at: time(at),
                sensed: time(sensed),
            }),
            causes: TickCauses {
                completed: self.completed,
                ..TickCauses::default()
            },
        }
    }
}

/// A published message.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PublishedMessage {
    /// Index of its topic.
    pub topic: usize,
    /// Position in the topic's history.
    pub seq: u64,
    /// Run time of publication.
    pub at: Time,
    /// Run time of the sensing behind it.
    pub origin: Option<Time>,
    /// The tick that published it, as the index of its node and the number there.
    pub by: Option<(usize, u64)>,
    /// The message that it was derived from, where its node names one.
    pub from: Option<SentMessage>,
    /// Whether its data begin with the tick, whatever that has read.
    pub begins: bool,
    /// Its numbers; `None` for one that is not finite.
    pub row: Vec<Option<f64>>,
}

/// Counters of a topic in one process.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct TopicCounts {
    /// Index of the topic.
    pub topic: usize,
    /// Messages lost unread there.
    pub dropped: u64,
    /// Messages lost on the way there.
    pub lost: u64,
    /// Messages refused there.
    pub refused: u64,
}

/// A command, and who gives it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Order {
    /// Number of the dashboard.
    pub by: u64,
    /// Name of the dashboard, for the others.
    pub name: String,
    /// The command.
    pub command: Command,
}

/// Whether a command was carried out: `Ok`, or the reason why not.
pub type Answer = Result<(), String>;
