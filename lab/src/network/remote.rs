//! The run of other processes, put together from what each of them reports.
//!
//! Like a replay: ticks, messages and events go into counters in the order of their run
//! times, which are those of the process that listens. They come from several processes, so
//! each waits a moment for those before it.

use std::{
    collections::{BTreeMap, HashMap},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use crossbeam_channel::{Receiver, Sender, unbounded};
use ratelab::{
    experiment::{Config, Experiment, Summary, Taps},
    runtime::{
        ClockExit, Command, Knob, Observer, TickRecord, Time,
        telemetry::{Event, EventKind, Lineage, NodeTopology, Topology},
    },
    system::System,
};
use ratelab_wire::{
    Answer, Follower,
    clock::{self, Nanos},
    telemetry::{Batch, Counts, Info, Message},
};

use super::{gathered::GatheredRun, recordings::Recordings, relay::Relay};
use crate::{
    dashboard::{Place, Remote, RunSource, WatchedRows, watched},
    recording::{ProcessRecord, Source, StopReason, schema::Origin},
};

/// How long an item waits for earlier ones of other processes.
const HOLD: Duration = Duration::from_millis(150);

/// Time without a report after which a process counts as gone.
const GONE: Duration = Duration::from_millis(500);

/// The most items that wait.
const MOST_PENDING: usize = 100_000;

/// The most reports that wait for their process to be known: seconds.
const MOST_EARLY: usize = 256;

/// A run of other processes.
pub struct RemoteRun {
    follower: Follower,
    system: Arc<dyn System>,
    /// The process that listens, and how its run began.
    hub: Option<Arc<Info>>,
    processes: HashMap<u64, Process>,
    /// Reports of processes that are not known yet.
    early: Vec<(u64, Batch)>,
    gathered: GatheredRun,
    /// The topics of the system.
    known: Taps,
    recordings: Arc<Mutex<Recordings>>,
    pending: BTreeMap<(Time, u64), Item>,
    items: u64,
    /// When messages arrived, by topic, sender and number.
    arrivals: HashMap<(usize, u64, u64), Time>,
    /// Messages lost unread in processes that were replaced, by topic.
    dropped_before: HashMap<usize, u64>,
    /// The run time from which on all processes report.
    complete: Option<Time>,
    lost_batches: u64,
    began: Instant,
    answers: (Sender<Answer>, Receiver<Answer>),
}

/// A process and its reports.
struct Process {
    info: Info,
    batch: u64,
    heard: Instant,
    counts: Vec<Counts>,
    /// Greatest error of its times in the run time of the one that listens; `None` while
    /// unknown.
    bound: Option<Nanos>,
    events: usize,
}

/// Something that happened.
enum Item {
    Event(Event),
    Tick(u64, usize, TickRecord),
    Message(u64, Message),
}

impl RemoteRun {
    /// Follows the run that `follower` is connected to. `experiment` has its graph until
    /// the processes send theirs.
    pub fn new(
        follower: Follower,
        experiment: &Experiment,
        recordings: Arc<Mutex<Recordings>>,
    ) -> Self {
        let (system, known) = (experiment.system(), experiment.taps());
        let (config, graph) = (experiment.config(), experiment.observer().topology());
        Self {
            follower,
            system: system.clone(),
            hub: None,
            processes: HashMap::new(),
            early: Vec::new(),
            gathered: gathered(system, config, &graph, &known),
            known,
            recordings,
            pending: BTreeMap::new(),
            items: 0,
            arrivals: HashMap::new(),
            dropped_before: HashMap::new(),
            complete: None,
            lost_batches: 0,
            began: Instant::now(),
            answers: unbounded(),
        }
    }

    /// Notes who is there; returns whether another run began.
    fn meet(&mut self) -> bool {
        let mut infos = self.follower.processes();
        infos.retain(|info| self.follower.estimate(info.clock).is_some());
        // The others' times are those of its run.
        infos.sort_by_key(|info| !info.is_hub);
        let mut new_run = false;
        for info in infos {
            let old = self.hub.as_ref().map(|hub| hub.incarnation);
            if info.is_hub && old != Some(info.incarnation) {
                self.begin(&info);
                new_run = true;
            }
            if !self.processes.contains_key(&info.incarnation) {
                let new = info.incarnation;
                self.add(info);
                let reports = self.early.extract_if(.., |(from, _)| *from == new);
                let reports: Vec<_> = reports.collect();
                reports
                    .into_iter()
                    .for_each(|(from, batch)| self.take(from, batch));
            }
        }
        new_run
    }

    /// Adds a process with its events so far, in place of one that ran the same nodes.
    fn add(&mut self, info: Info) {
        let same = |other: &Process| other.info.nodes.iter().any(|n| info.nodes.contains(n));
        let replaced = self.processes.extract_if(|_, other| same(other));
        for counts in replaced.flat_map(|(_, process)| process.counts) {
            *self.dropped_before.entry(counts.topic).or_default() += counts.dropped;
        }
        let (from, zero) = (info.incarnation, info.zero);
        let events = info.events.clone();
        let process = Process {
            info,
            batch: 0,
            heard: Instant::now(),
            counts: Vec::new(),
            bound: None,
            events: 0,
        };
        self.processes.insert(from, process);
        if let Some((shift, _)) = zero.and_then(|zero| self.shift(from, zero)) {
            self.take_events(from, 0, &events, shift);
        }
    }

    /// Begins the picture of another run.
    fn begin(&mut self, hub: &Info) {
        self.complete_last();
        self.gathered = gathered(&self.system, &hub.config, &hub.topology, &self.known);
        self.hub = Some(Arc::new(hub.clone()));
        self.pending.clear();
        self.arrivals.clear();
        self.dropped_before.clear();
        self.complete = None;
        self.began = Instant::now();
    }

    /// Adds what still waits of the last run, and ends its recording.
    fn complete_last(&mut self) {
        if self.hub.is_none() {
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
        self.recordings
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }

    /// The run for a recorder.
    fn source(&self) -> Source {
        let (system, gathered) = (self.system.clone(), &self.gathered);
        let (config, topology) = (gathered.config.clone(), gathered.topology.clone());
        let mut origin = Origin::new(&*system, config, topology);
        let processes = self.processes.values().map(|process| ProcessRecord {
            host: process.info.host.clone(),
            pid: process.info.pid,
            nodes: process.info.nodes.clone(),
            error_ns: process.bound.and_then(|bound| u64::try_from(bound).ok()),
        });
        origin.processes = processes.collect();
        origin.processes.sort_by_key(|process| process.pid);
        Source {
            notice: |_| {},
            system,
            origin,
            start: gathered.start.clone(),
            observer: gathered.observer.clone(),
            taps: gathered.relay.clone(),
            viewer: None,
        }
    }

    /// The moment of run time zero by our clock, with its error, once the run has begun.
    fn zero(&self, process: &Info, zero: Nanos) -> Option<(Nanos, Nanos)> {
        let estimate = self.follower.estimate(process.clock)?;
        Some((estimate.ours(zero), estimate.bound))
    }

    /// Takes the reports that have come.
    fn hear(&mut self) {
        let batches: Vec<(u64, Batch)> = self.follower.batches().collect();
        for (from, batch) in batches {
            if self.processes.contains_key(&from) {
                self.take(from, batch);
            } else if self.early.len() < MOST_EARLY {
                self.early.push((from, batch));
            }
        }
    }

    fn take(&mut self, from: u64, batch: Batch) {
        self.note_zero(from, batch.zero);
        let Some((shift, bound)) = self.shift(from, batch.zero) else {
            return;
        };
        let Some(process) = self.processes.get_mut(&from) else {
            return;
        };
        let missed = batch.number.saturating_sub(process.batch + 1);
        self.lost_batches += if process.batch == 0 { 0 } else { missed };
        process.batch = batch.number;
        process.heard = Instant::now();
        process.counts.clone_from(&batch.topics);
        process.bound = Some(bound);
        self.take_events(from, batch.first_event, &batch.events, shift);
        let time = |time| shifted(time, shift);
        for (node, tick) in batch.ticks {
            let tick = tick.record(time);
            self.hold(tick.at, Item::Tick(from, node, tick));
        }
        for message in batch.sent {
            let (at, origin) = (time(message.at), message.origin.map(time));
            let message = Message {
                at,
                origin,
                ..message
            };
            self.hold(at, Item::Message(from, message));
        }
        for arrival in batch.arrived {
            let key = (arrival.topic, arrival.incarnation, arrival.seq);
            self.arrivals.insert(key, time(arrival.at));
        }
    }

    /// Notes when the run began in the process that listens.
    fn note_zero(&mut self, from: u64, zero: Nanos) {
        let hub = self.hub.as_ref().filter(|hub| hub.incarnation == from);
        if let Some(hub) = hub.filter(|hub| hub.zero.is_none()) {
            let zero = Some(zero);
            self.hub = Some(Arc::new(Info {
                zero,
                ..(**hub).clone()
            }));
        }
    }

    /// What is to be added to run times of a process (ns), and the greatest error of that;
    /// `None` while unknown.
    fn shift(&self, from: u64, zero: Nanos) -> Option<(Nanos, Nanos)> {
        let hub = self.hub.as_ref()?;
        let (process, hub_zero) = (&self.processes.get(&from)?.info, hub.zero?);
        if process.clock == hub.clock {
            return Some((zero - hub_zero, 0));
        }
        let (of_hub, error) = self.zero(hub, hub_zero)?;
        let (of_process, more) = self.zero(process, zero)?;
        Some((of_process.saturating_sub(of_hub), error + more))
    }

    /// Takes the events that are new, and to be shown: topics are in several processes, and
    /// one log of each is enough.
    fn take_events(&mut self, from: u64, first: usize, events: &[Event], shift: Nanos) {
        let own = self.hub.as_ref().is_some_and(|hub| hub.incarnation == from);
        let Some(process) = self.processes.get_mut(&from) else {
            return;
        };
        let skip = process.events.saturating_sub(first);
        process.events = process.events.max(first + events.len());
        let nodes = process.info.nodes.clone();
        for event in events.iter().skip(skip) {
            let of_node = match &event.what {
                EventKind::Applied { command, .. } | EventKind::Refused { command, .. } => {
                    node_of(command).is_some_and(|node| nodes.contains(&node))
                }
                EventKind::Ended { .. } | EventKind::Faulted { .. } => true,
                EventKind::Presence { .. } => false,
            };
            if own || of_node {
                let at = shifted(event.at, shift);
                let what = event.what.clone();
                self.hold(at, Item::Event(Event { at, what }));
            }
        }
    }

    fn hold(&mut self, at: Time, item: Item) {
        if self.pending.len() < MOST_PENDING {
            self.items += 1;
            self.pending.insert((at, self.items), item);
        }
    }

    /// The run time now, less what is held back; `None` before the run.
    fn ripe(&self) -> Option<Time> {
        let hub = self.hub.as_ref()?;
        let (zero, _) = self.zero(hub, hub.zero?)?;
        let hold = Nanos::try_from(HOLD.as_nanos()).ok()?;
        let passed = clock::now() - zero - hold;
        Some(Time::from_nanos(u64::try_from(passed).unwrap_or(0)))
    }

    /// Puts everything together that happened before the moment that is shown.
    fn advance(&mut self) {
        let Some(ripe) = self.ripe() else {
            return;
        };
        let heard = |node: &NodeTopology| {
            self.process_of(&node.name)
                .is_some_and(|process| process.batch > 0)
        };
        if self.complete.is_none() && self.gathered.topology.nodes.iter().all(heard) {
            self.complete = Some(ripe + HOLD);
        }
        self.gather_until(ripe);
        let is_gone = self
            .hub
            .as_ref()
            .is_none_or(|hub| self.is_gone(hub.incarnation));
        if !is_gone {
            self.gathered.set_now(ripe);
        }
        self.arrivals.retain(|_, at| *at + HOLD * 4 > ripe);
    }

    /// Puts together what happened before run time `until`.
    fn gather_until(&mut self, until: Time) {
        let later = self.pending.split_off(&(until, 0));
        let due = std::mem::replace(&mut self.pending, later);
        if !due.is_empty() && self.recordings().is_waiting() {
            let source = self.source();
            self.recordings().begin_of_run(source);
        }
        for item in due.into_values() {
            match item {
                Item::Event(event) => self.gathered.event(&event),
                Item::Tick(from, node, tick) => self.gathered.tick(from, node, tick),
                Item::Message(from, message) => {
                    let arrives = self.arrives(from, &message);
                    let dropped = self.dropped(message.topic);
                    self.gathered.message(from, message, arrives, dropped);
                }
            }
        }
        self.gathered.settle();
    }

    /// When a message reached its reader; `None` if it did not. Within a process it is at
    /// once.
    fn arrives(&mut self, from: u64, message: &Message) -> Option<Time> {
        let topic = self.gathered.topology.topics.get(message.topic)?;
        let process = self.processes.get(&from);
        let mut readers = topic
            .readers
            .iter()
            .map(|node| &self.gathered.topology.nodes[*node]);
        let near = |name: &String| process.is_none_or(|p| p.info.nodes.contains(name));
        if readers.all(|node| near(&node.name)) {
            return Some(message.at);
        }
        let arrived = self.arrivals.remove(&(message.topic, from, message.seq));
        match arrived {
            Some(arrived) => Some(arrived.max(message.at)),
            // Its arrival was reported to nobody.
            None if self.complete.is_none_or(|since| message.at < since) => Some(message.at),
            None => None,
        }
    }

    /// Messages of a topic lost unread so far, in all processes.
    fn dropped(&self, topic: usize) -> u64 {
        let counts = self.processes.values().flat_map(|process| &process.counts);
        let counts = counts.filter(|counts| counts.topic == topic);
        let now: u64 = counts.map(|counts| counts.dropped).sum();
        now + self.dropped_before.get(&topic).unwrap_or(&0)
    }

    fn is_gone(&self, incarnation: u64) -> bool {
        let process = self.processes.get(&incarnation);
        process.is_none_or(|process| process.heard.elapsed() > GONE)
    }

    /// The process that runs `node`.
    fn process_of(&self, node: &str) -> Option<&Process> {
        let mut processes = self.processes.values();
        processes.find(|process| process.info.nodes.iter().any(|name| name == node))
    }
}

impl Drop for RemoteRun {
    fn drop(&mut self) {
        self.complete_last();
    }
}

/// The beginning of a run with this configuration and graph.
fn gathered(
    system: &Arc<dyn System>,
    config: &Config,
    graph: &Topology,
    known: &Taps,
) -> GatheredRun {
    let fields = |name: &str| {
        let mut topics = known.topics().iter();
        let topic = topics.find(|topic| topic.name() == name)?;
        Some(topic.fields())
    };
    let relay = Relay::new(graph, fields);
    GatheredRun::new(system, config.clone(), graph.clone(), relay)
}

/// Run time `time`, `shift` ns later.
fn shifted(time: Time, shift: Nanos) -> Time {
    let at = i128::from(time.as_nanos()) + i128::from(shift);
    Time::from_nanos(u64::try_from(at.max(0)).unwrap_or(u64::MAX))
}

/// The node that a command is for.
fn node_of(command: &Command) -> Option<String> {
    match command {
        Command::Set(knob) if !knob.kind().is_of_topic() => Some(knob.target().to_owned()),
        _ => None,
    }
}

impl RunSource for RemoteRun {
    fn shared_system(&self) -> &Arc<dyn System> {
        &self.system
    }

    fn config(&self) -> &Config {
        &self.gathered.config
    }

    fn observer(&self) -> &Observer {
        &self.gathered.observer
    }

    fn wall_time(&self) -> Duration {
        self.began.elapsed()
    }

    fn lineage(&mut self) -> &Lineage {
        self.gathered.lineage()
    }

    fn known_lineage(&self) -> &Lineage {
        self.gathered.lineage()
    }

    fn new_rows(&mut self) -> Vec<WatchedRows> {
        let new = self.gathered.take_rows();
        let topics = &self.gathered.topology.topics;
        let names: Vec<&'static str> = watched(&*self.system).collect();
        let new = new.into_iter().filter_map(|(topic, rows)| {
            let name = &topics.get(topic)?.name;
            let watched = names.iter().find(|watched| *watched == name)?;
            Some((*watched, rows))
        });
        new.collect()
    }

    fn lost(&self) -> u64 {
        self.lost_batches
    }

    fn summary(&self) -> Option<&Summary> {
        None
    }

    fn place(&self, node: &str) -> Option<Place> {
        let Some(process) = self.process_of(node) else {
            let text = "nowhere".to_owned();
            return Some(Place { text, gone: true });
        };
        Some(Place {
            text: format!("{}@{}", process.info.pid, process.info.host),
            gone: self.is_gone(process.info.incarnation),
        })
    }
}

impl Remote for RemoteRun {
    fn update(&mut self) -> bool {
        let new = self.meet();
        self.hear();
        self.advance();
        new
    }

    fn turn(&mut self, knob: Knob) {
        let (order, answers) = (self.follower.commander(), self.answers.0.clone());
        // The answer may take a second.
        std::thread::spawn(move || {
            let _ = answers.send(order(knob.into()));
        });
    }

    fn record(&mut self) -> String {
        if self.hub.is_none() {
            return "there is no run yet".to_owned();
        }
        let source = self.source();
        self.recordings().toggle(source)
    }

    fn recording(&self) -> Option<u64> {
        self.recordings().lost()
    }

    fn refusal(&mut self) -> Option<String> {
        let answers = self.answers.1.try_iter();
        answers.filter_map(Result::err).last()
    }

    fn trouble(&self) -> Option<String> {
        if self.hub.is_none() {
            return Some("waiting for the process that listens".to_owned());
        }
        let gone = self.processes.values().filter_map(|process| {
            let silent = process.heard.elapsed();
            let names = process.info.nodes.join(" and ");
            (silent > GONE).then(|| (names, silent.as_secs_f64()))
        });
        let mut gone: Vec<(String, f64)> = gone.collect();
        gone.sort_by(|one, other| one.0.cmp(&other.0));
        if let (Some((_, seconds)), true) = (gone.first(), gone.len() == self.processes.len()) {
            return Some(format!("all nodes gone for {seconds:.1} s"));
        }
        let gone = gone.iter();
        let gone = gone.map(|(names, seconds)| format!("{names} gone for {seconds:.1} s"));
        let mut gone: Vec<String> = gone.collect();
        let refused: u64 = self
            .processes
            .values()
            .flat_map(|process| &process.counts)
            .map(|counts| counts.refused)
            .sum();
        if refused > 0 {
            gone.push(format!("{refused} messages refused"));
        }
        Some(gone.join(", ")).filter(|text| !text.is_empty())
    }

    fn clocks(&self) -> Option<String> {
        let others = self
            .processes
            .values()
            .filter(|process| !process.info.is_hub);
        let bounds: Vec<Option<Nanos>> = others.map(|process| process.bound).collect();
        if bounds.contains(&None) {
            return Some("ages ?".to_owned());
        }
        let worst = bounds
            .into_iter()
            .flatten()
            .max()
            .filter(|bound| *bound > 0)?;
        Some(format!("ages ±{:.1} ms", worst as f64 / 1e6))
    }
}
