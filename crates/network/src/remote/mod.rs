//! The run of other processes, put together from what each of them reports.
//!
//! Like a replay: ticks, messages and events go into counters in the order of their run
//! times, which are those of the process that listens. They come from several processes, so
//! each waits a moment for those before it.

mod gathered;
mod processes;
mod relay;
mod shown;

use std::{
    collections::HashMap,
    mem,
    sync::{Arc, Mutex, MutexGuard},
    time::{Duration, Instant},
};

use crossbeam_channel::{Receiver, Sender, unbounded};
use ratelab::{ClockExit, Event, Time, sync::lock};
use ratelab_experiment::{Experiment, Taps};
use ratelab_metrics::TickRecord;
use ratelab_recording::{Origin, Source, StopReason};
use ratelab_system::System;

use self::{
    gathered::GatheredRun,
    processes::{Inexact, Processes},
};
use crate::{
    Follower,
    machine::{self, Nanos},
    telemetry::{Answer, Batch, Info, PublishedMessage, Read, SentMessage},
};

pub use relay::Recordings;

/// How long an item waits for earlier ones of other processes.
const HOLD: Duration = Duration::from_millis(150);

/// Run time for which a recording waits for the answers of all processes.
const GREETING: Duration = Duration::from_secs(2);

/// The most items that wait.
const MOST_PENDING: usize = 100_000;

/// The most reports that wait for their process to be known: seconds.
const MOST_EARLY: usize = 256;

/// The command lines that a dashboard names.
pub trait StartCommands {
    /// Returns the command line that starts `node`.
    fn node(&self, node: &str) -> String;

    /// Returns the command line that shows the run of `system`.
    fn lab(&self, system: &str) -> String;
}

/// A run of other processes.
pub struct RemoteRun {
    follower: Follower,
    system: Arc<dyn System>,
    processes: Processes,
    /// Reports of processes that are not known yet.
    early: Vec<(u64, Batch)>,
    gathered: GatheredRun,
    /// The topics of the system.
    known: Taps,
    recordings: Arc<Mutex<Recordings>>,
    /// How to start what is missing.
    commands: Box<dyn StartCommands>,
    /// What waits, in the order in which it came.
    pending: Vec<(Time, Item)>,
    /// When messages arrived.
    arrivals: HashMap<SentMessage, Time>,
    /// The run time from which on all processes report.
    complete: Option<Time>,
    lost_batches: u64,
    began: Instant,
    answers: (Sender<Answer>, Receiver<Answer>),
}

/// Something that happened.
enum Item {
    Event(Event),
    Tick(u64, usize, TickRecord, Vec<Read>),
    Message(u64, PublishedMessage),
}

impl RemoteRun {
    /// Follows the run that `follower` is connected to. `experiment` has its graph until
    /// the processes send theirs.
    pub fn new(
        follower: Follower,
        experiment: &Experiment,
        recordings: Arc<Mutex<Recordings>>,
        commands: Box<dyn StartCommands>,
    ) -> Self {
        let (system, known) = (experiment.system(), experiment.taps());
        let (config, graph) = (experiment.config(), experiment.observer().topology());
        Self {
            follower,
            system: system.clone(),
            processes: Processes::default(),
            early: Vec::new(),
            gathered: GatheredRun::new(system, config, &graph, &known),
            known,
            recordings,
            commands,
            pending: Vec::new(),
            arrivals: HashMap::new(),
            complete: None,
            lost_batches: 0,
            began: Instant::now(),
            answers: unbounded(),
        }
    }

    /// Notes who is there; returns whether another run began.
    fn meet(&mut self) -> bool {
        let mut infos = self.follower.processes();
        let present = infos.iter().map(|info| info.incarnation);
        self.processes.set_present(present);
        // The others' times are times of its run.
        infos.sort_by_key(|info| !info.is_hub);
        let mut new_run = false;
        for info in infos {
            let Some(estimate) = self.follower.estimate(info.clock) else {
                continue;
            };
            self.processes.set_clock(info.clock, estimate);
            let new = info.incarnation;
            let old = self.processes.hub().map(|hub| hub.incarnation);
            if info.is_hub && old != Some(new) {
                self.begin(&info);
                new_run = true;
            }
            if !self.processes.know(new) {
                self.add(info);
            }
        }
        new_run
    }

    /// Adds a process with its events so far.
    fn add(&mut self, mut info: Info) {
        let (from, zero) = (info.incarnation, info.zero);
        let events = mem::take(&mut info.events);
        self.processes.add(info);
        if let Some(shift) = zero.and_then(|zero| self.processes.shift(from, zero)) {
            self.take_events(from, 0, &events, shift.nanos);
        }
    }

    /// Begins the picture of another run.
    fn begin(&mut self, hub: &Info) {
        self.complete_last();
        self.gathered = GatheredRun::new(&self.system, &hub.config, &hub.topology, &self.known);
        self.processes.begin(hub);
        self.pending.clear();
        self.arrivals.clear();
        self.complete = None;
        self.began = Instant::now();
    }

    /// Returns whether the run is over, and `node` was in the process that began it.
    fn has_left_after(&self, node: &str) -> bool {
        let began = self.processes.hub().is_some_and(|hub| hub.runs(node));
        began && self.gathered.exit().is_some()
    }

    /// Adds what still waits of the last run, and ends its recording.
    fn complete_last(&mut self) {
        if self.processes.hub().is_none() {
            return;
        }
        self.gather_until(Time::MAX);
        let end = self.gathered.end();
        let seen = match &end {
            StopReason::Run(summary) => ((**summary).clone(), true),
            _ => (self.gathered.summary(&ClockExit::Stopped), false),
        };
        let mut recordings = self.recordings();
        recordings.last = Some(seen);
        recordings.end(end);
    }

    fn recordings(&self) -> MutexGuard<'_, Recordings> {
        lock(&self.recordings)
    }

    /// Returns the run for a recorder.
    fn source(&self) -> Source {
        let (system, gathered) = (self.system.clone(), &self.gathered);
        let (config, topology) = (gathered.config.clone(), gathered.topology.clone());
        let mut origin = Origin::new(&*system, config, topology);
        origin.processes = self.processes.records();
        Source {
            system,
            origin,
            start: gathered.start.clone(),
            observer: gathered.observer.clone(),
            taps: gathered.relay.clone(),
            notice: |_| {},
        }
    }

    /// Takes the reports that have come.
    fn hear(&mut self) {
        let mut batches = mem::take(&mut self.early);
        batches.extend(self.follower.batches());
        for (from, batch) in batches {
            if self.processes.know(from) {
                self.take(from, batch);
            } else if self.early.len() < MOST_EARLY {
                self.early.push((from, batch));
            }
        }
    }

    fn take(&mut self, from: u64, batch: Batch) {
        self.processes.note_zero(from, batch.zero);
        let Some(Inexact {
            nanos: shift,
            error,
        }) = self.processes.shift(from, batch.zero)
        else {
            return;
        };
        let lost = self.processes.report(from, &batch, error);
        self.lost_batches = self.lost_batches.saturating_add(lost);
        self.take_events(from, batch.first_event, &batch.events, shift);
        let time = |time| shifted(time, shift);
        for (node, tick) in batch.ticks {
            let record = tick.record(time);
            self.hold(record.at, Item::Tick(from, node, record, tick.reads));
        }
        for message in batch.sent {
            let (at, origin) = (time(message.at), message.origin.map(time));
            let message = PublishedMessage {
                at,
                origin,
                ..message
            };
            self.hold(at, Item::Message(from, message));
        }
        let arrived = batch.arrived.into_iter();
        self.arrivals
            .extend(arrived.map(|(message, at)| (message, time(at))));
    }

    /// Takes the events that are new, and to be shown.
    fn take_events(&mut self, from: u64, first: usize, events: &[Event], shift: Nanos) {
        for event in self.processes.new_events(from, first, events) {
            let at = shifted(event.at, shift);
            let what = event.what.clone();
            self.hold(at, Item::Event(Event { at, what }));
        }
    }

    fn hold(&mut self, at: Time, item: Item) {
        if self.pending.len() < MOST_PENDING {
            self.pending.push((at, item));
        }
    }

    /// Returns the run time now, less what is held back; `None` before the run.
    fn ripe(&self) -> Option<Time> {
        let zero = self.processes.zero()?.nanos;
        let hold = Nanos::try_from(HOLD.as_nanos()).ok()?;
        let passed = machine::now().saturating_sub(zero).saturating_sub(hold);
        Some(Time::from_nanos(u64::try_from(passed).unwrap_or(0)))
    }

    /// Puts everything together that happened before the moment that is shown.
    fn advance(&mut self) {
        let Some(ripe) = self.ripe() else {
            return;
        };
        let mut nodes = self.gathered.topology.nodes.iter();
        if self.complete.is_none() && nodes.all(|node| self.processes.have_heard(&node.name)) {
            self.complete = Some(ripe + HOLD);
        }
        if self.awaits_process(ripe) {
            return;
        }
        self.gather_until(ripe);
        if !self.processes.lack_hub() {
            self.gathered.set_now(ripe);
        }
        self.arrivals.retain(|_, at| *at + HOLD * 4 > ripe);
    }

    /// Returns whether a recording that begins now would lack a process that has yet to answer: its
    /// head names them all.
    fn awaits_process(&self, ripe: Time) -> bool {
        let knows_all = self
            .gathered
            .topology
            .nodes
            .iter()
            .all(|node| self.processes.with_node(&node.name).is_some());
        !knows_all && ripe < Time::ZERO + GREETING && self.recordings().is_waiting()
    }

    /// Puts together what happened before run time `until`.
    fn gather_until(&mut self, until: Time) {
        self.pending.sort_by_key(|(at, _)| *at);
        let due = self.pending.partition_point(|(at, _)| *at < until);
        let due: Vec<(Time, Item)> = self.pending.drain(..due).collect();
        if !due.is_empty() && self.recordings().is_waiting() {
            let source = self.source();
            self.recordings().begin_of_run(source);
        }
        for (_, item) in due {
            match item {
                Item::Event(event) => self.gathered.event(&event),
                Item::Tick(from, node, tick, reads) => {
                    self.gathered.tick(from, node, tick, &reads);
                }
                Item::Message(from, message) => {
                    let arrives = self.arrives(from, &message);
                    let dropped = self.processes.dropped(message.topic);
                    self.gathered.message(from, message, arrives, dropped);
                }
            }
        }
        self.gathered.settle();
    }

    /// Returns when a message reached its reader; `None` if it did not. Within a process it is at
    /// once.
    fn arrives(&mut self, from: u64, message: &PublishedMessage) -> Option<Time> {
        let graph = &self.gathered.topology;
        let topic = graph.topics.get(message.topic)?;
        let mut readers = topic
            .readers
            .iter()
            .filter_map(|node| graph.nodes.get(*node));
        if readers.all(|node| self.processes.runs(from, &node.name)) {
            return Some(message.at);
        }
        let sent = SentMessage {
            topic: message.topic,
            incarnation: from,
            seq: message.seq,
        };
        match self.arrivals.remove(&sent) {
            Some(arrived) => Some(arrived.max(message.at)),
            // Its arrival was reported to nobody.
            None if self.complete.is_none_or(|since| message.at < since) => Some(message.at),
            None => None,
        }
    }
}

impl Drop for RemoteRun {
    fn drop(&mut self) {
        self.complete_last();
    }
}

/// Returns the run time `time`, `shift` ns later.
fn shifted(time: Time, shift: Nanos) -> Time {
    let at = i128::from(time.as_nanos()) + i128::from(shift);
    Time::from_nanos(u64::try_from(at.max(0)).unwrap_or(u64::MAX))
}
