//! Snapshots of a running graph.

use std::time::Duration;

use super::{
    Distribution, Event, EventKind, EventLog, Flight, Meter, MeterRecorder, NodeCounters, PushAge,
    PushAgeView, ReadMark, TopicCounters,
};
use crate::{
    command::{ClockKind, Speed},
    executor::Executor,
    reexecution::{Log, LogPosition, RunLog},
    sync::{
        Arc, Instant, Mutex,
        atomic::{AtomicU64, Ordering},
        lock,
    },
    time::{Hz, Time},
    trigger::Match,
};

/// The state of a graph's clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Status {
    /// The current clock, or the last one.
    pub clock: ClockKind,
    /// Whether a command has paused run time.
    pub paused: bool,
    /// Speed of the virtual clock.
    pub speed: Speed,
}

/// State of a run, written by its clock and read by observers.
#[derive(Debug)]
pub(crate) struct RunState {
    pub(crate) now: AtomicU64,
    pub(crate) status: Mutex<Status>,
    pub(crate) log: EventLog,
    /// What the threads of the real clock did.
    pub(crate) threads: RunLog,
    /// The moment of run time zero, while a real clock runs the graph.
    pub(crate) zero: Mutex<Option<Instant>>,
}

impl RunState {
    /// Advances run time to at least `now`.
    pub(crate) fn advance_to(&self, now: Time) {
        self.now.fetch_max(now.as_nanos(), Ordering::Relaxed);
    }
}

/// A node as shared by the graph and its observers.
#[derive(Clone, Debug)]
pub(crate) struct NodeEntry {
    pub(crate) name: Arc<str>,
    pub(crate) priority: u32,
    pub(crate) counters: Arc<NodeCounters>,
    lateness: Meter,
    tick_time: Meter,
    response: Meter,
    pub(crate) meters: Vec<(String, Meter)>,
    pub(crate) push_age: Option<PushAge>,
    /// Whether it runs in another process.
    pub(crate) remote: bool,
    /// Indices of the topics that trigger it; empty for a node at a rate.
    pub(crate) triggers: Arc<[usize]>,
    /// What a tick needs of them.
    pub(crate) matching: Match,
    /// Its executor, if it has no thread of its own.
    pub(crate) executor: Option<Executor>,
    /// Number of that executor in the graph, if its nodes share threads.
    pub(crate) executor_index: Option<usize>,
    /// Its mutually exclusive callback group there, if it shares one.
    pub(crate) group: Option<Arc<str>>,
}

/// The writing side of the meters of a node's ticks.
#[derive(Debug)]
pub(crate) struct TickMeters {
    lateness: MeterRecorder,
    tick_time: MeterRecorder,
    response: MeterRecorder,
}

impl TickMeters {
    /// Adds a tick: how late it began and how long it took, where that was measured.
    pub(crate) fn record(&mut self, lateness: Option<Duration>, took: Option<Duration>) {
        if let Some(lateness) = lateness {
            self.lateness.record(lateness);
        }
        if let Some(took) = took {
            self.tick_time.record(took);
            self.response.record(lateness.unwrap_or_default() + took);
        }
    }
}

/// A topic as shared by the graph and its observers.
#[derive(Clone, Debug)]
pub(crate) struct TopicEntry {
    pub(crate) name: Arc<str>,
    pub(crate) counters: Arc<TopicCounters>,
    pub(crate) publishers: Vec<usize>,
    pub(crate) subscriptions: Vec<SubscriptionEntry>,
}

/// A subscription as shared by the graph and its observers.
#[derive(Clone, Debug)]
pub(crate) struct SubscriptionEntry {
    pub(crate) node: usize,
    pub(crate) mark: Arc<ReadMark>,
    pub(crate) ages: Meter,
}

/// Reads a running graph from any thread, without slowing it.
///
/// ```
/// use std::thread;
/// use ratelab::{Clock, GO_ON, Graph, Hz, Inbox, Time, VirtualClock};
///
/// let mut graph = Graph::new();
/// graph.node("camera", Hz::new(30.0)?, 0, |_| |_| GO_ON)?;
/// let (observer, end) = (graph.observer(), Time::from_secs_f64(100.0)?);
/// thread::scope(|scope| {
///     scope.spawn(|| {
///         while observer.now() < end {
///             thread::yield_now();
///         }
///         assert_eq!(observer.snapshot().nodes[0].ticks, 3_001);
///     });
///     VirtualClock.run(&mut graph, &mut Inbox::default(), end)
/// })?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Observer {
    pub(crate) state: Arc<RunState>,
    pub(crate) nodes: Vec<NodeEntry>,
    pub(crate) topics: Vec<TopicEntry>,
}

/// A graph with its counters at one moment: structure and figures, without locks.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// Run time of the last tick or command.
    pub now: Time,
    /// The state of the graph's clock.
    pub status: Status,
    /// The nodes, in the order of addition.
    pub nodes: Vec<NodeView>,
    /// The topics, in the order of their first connection.
    pub topics: Vec<TopicView>,
}

/// A node in a [`Snapshot`].
#[derive(Clone, Debug)]
pub struct NodeView {
    /// Its name.
    pub name: Arc<str>,
    /// Priority among nodes that are due at the same instant, lowest first.
    pub priority: u32,
    /// The rate in force; that of the messages for a node that they trigger.
    pub hz: Hz,
    /// The topics that trigger it, as indices into [`Snapshot::topics`]; empty for a node
    /// at a rate.
    pub triggers: Arc<[usize]>,
    /// Its executor; `None` for a thread of its own.
    pub executor: Option<Executor>,
    /// Ticks so far.
    pub ticks: u64,
    /// Periods skipped because the node was still busy.
    pub overruns: u64,
    /// Whether it is in a tick. In virtual time ticks take no time unless a duration is
    /// set.
    pub busy: bool,
    /// Whether it crashed without a restart since.
    pub crashed: bool,
    /// Whether it runs in another process, which has its figures.
    pub remote: bool,
    /// Lateness of ticks. In virtual time it is measured only where a lateness is set.
    pub lateness: Distribution,
    /// Duration of ticks: in run time where a duration is set, otherwise in wall time.
    /// The wall time is not measured while the virtual clock runs at unlimited speed.
    pub tick_time: Distribution,
    /// Response time: from the due time to the end of a tick, lateness plus tick time.
    pub response: Distribution,
    /// The node's own measurements.
    pub meters: Vec<MeterView>,
    /// Age of the sensing behind the node's pushes on the world, if it makes any.
    pub push_age: Option<PushAgeView>,
}

/// A node's own measurement in a [`Snapshot`].
#[derive(Clone, Debug)]
pub struct MeterView {
    /// Name of the measurement.
    pub name: String,
    /// The figures.
    pub distribution: Distribution,
}

/// A topic in a [`Snapshot`].
#[derive(Clone, Debug)]
pub struct TopicView {
    /// Its name.
    pub name: Arc<str>,
    /// Queue depth.
    pub depth: usize,
    /// Messages published so far.
    pub published: u64,
    /// Messages lost by its link.
    pub lost: u64,
    /// Messages that its link delivered after a newer one: these are never read.
    pub overtaken: u64,
    /// Messages in flight at the last publication or reading, or at the end of the run.
    pub in_flight: u64,
    /// Messages that its link lost within the last second.
    pub lost_lately: u64,
    /// Recent ways of messages through its link; empty without one.
    pub flights: Vec<Flight>,
    /// Messages per second over the last second.
    pub per_second: f64,
    /// Run time of the newest message; `None` before the first.
    pub newest: Option<Time>,
    /// The nodes that publish to it, as indices into [`Snapshot::nodes`].
    pub publishers: Vec<usize>,
    /// The subscriptions.
    pub subscriptions: Vec<SubscriptionView>,
}

impl TopicView {
    /// Mean messages per second of a run up to `now`.
    pub fn average(&self, now: Time) -> f64 {
        let seconds = now.as_secs_f64();
        if seconds > 0.0 {
            self.published as f64 / seconds
        } else {
            0.0
        }
    }

    /// Messages lost unread, over all subscriptions.
    pub fn dropped(&self) -> u64 {
        self.subscriptions.iter().map(|s| s.dropped).sum()
    }

    /// Of these, messages lost within the last second.
    pub fn dropped_lately(&self) -> u64 {
        self.subscriptions.iter().map(|s| s.dropped_lately).sum()
    }
}

/// A subscription in a [`Snapshot`].
#[derive(Clone, Debug)]
pub struct SubscriptionView {
    /// The reading node, as an index into [`Snapshot::nodes`].
    pub node: usize,
    /// Messages evicted before the subscription saw them.
    pub dropped: u64,
    /// Of these, messages evicted within the last second.
    pub dropped_lately: u64,
    /// Ages of messages when the subscription read them.
    pub ages: Distribution,
}

impl Snapshot {
    /// The node called `name`.
    pub fn node(&self, name: &str) -> Option<&NodeView> {
        self.nodes.iter().find(|node| &*node.name == name)
    }

    /// The measurement `name` of the node called `node`.
    pub fn meter(&self, node: &str, name: &str) -> Option<&Distribution> {
        let meters = &self.node(node)?.meters;
        let meter = meters.iter().find(|meter| meter.name == name)?;
        Some(&meter.distribution)
    }

    /// The period of the node called `name`; zero if there is none.
    pub fn period(&self, name: &str) -> Duration {
        self.node(name)
            .map_or(Duration::ZERO, |node| node.hz.period())
    }

    /// The topic called `name`.
    pub fn topic(&self, name: &str) -> Option<&TopicView> {
        self.topics.iter().find(|topic| &*topic.name == name)
    }
}

impl Observer {
    /// Reads all counters. Those of one topic or node are consistent when the graph is at
    /// rest; while it runs each is read independently.
    pub fn snapshot(&self) -> Snapshot {
        self.view(self.now(), Meter::read)
    }

    /// Reads everything as of the end of the run at run time `end`: under the real clock
    /// a tick may begin a little later than the tick that ends the run.
    pub fn snapshot_at_end(&self, end: Time) -> Snapshot {
        self.view(self.now().min(end), Meter::read)
    }

    /// The same with empty distributions: reading those is most of the work, and they
    /// change slowly.
    pub fn read_counters(&self) -> Snapshot {
        self.view(self.now(), |_| Distribution::empty())
    }

    fn view(&self, now: Time, read: fn(&Meter) -> Distribution) -> Snapshot {
        let nodes = self.nodes.iter().zip(self.rates());
        Snapshot {
            now,
            status: self.status(),
            nodes: nodes.map(|(node, hz)| node.view(hz, now, read)).collect(),
            topics: self
                .topics
                .iter()
                .map(|topic| topic.view(now, read))
                .collect(),
        }
    }

    /// Run time of the last tick or command.
    pub fn now(&self) -> Time {
        Time::from_nanos(self.state.now.load(Ordering::Relaxed))
    }

    /// The state of the graph's clock.
    pub fn status(&self) -> Status {
        *lock(&self.state.status)
    }

    /// The moment of run time zero under the real clock; `None` in virtual time, before
    /// the run and during a pause.
    pub fn zero(&self) -> Option<Instant> {
        *lock(&self.state.zero)
    }

    /// Logs that a node in another process appeared or fell silent.
    pub fn note_presence(&self, at: Time, node: &str, present: bool, what: &str) {
        let (node, what) = (node.to_owned(), what.to_owned());
        let presence = EventKind::Presence {
            node,
            present,
            what,
        };
        self.state.log.note(at, presence);
    }

    /// Commands and ends of the run so far, starting with number `first`.
    pub fn events(&self, first: usize) -> Vec<Event> {
        self.state.log.since(first)
    }

    /// What the threads of the real clock did after `position`: bytes for a
    /// [`Log`](crate::Log), each piece with its thread. Moves the position to
    /// the end. Events that these mention are in [`events`](Self::events) afterwards.
    pub fn log_since(&self, position: &mut LogPosition) -> Vec<(usize, Vec<u8>)> {
        self.state.threads.since(position)
    }

    /// The names of the topics and [`Shared`](crate::Shared) values that a thread
    /// outside of the graph wrote to while the graph was under the real clock: such a run
    /// cannot come back. Each is known as soon as a node has been there next.
    pub fn written_from_outside(&self) -> Vec<std::sync::Arc<str>> {
        self.state.threads.written_from_outside()
    }

    /// The log of the run so far, as far as it was under the real clock.
    pub fn log(&self) -> Log {
        self.state
            .threads
            .since(&mut LogPosition::default())
            .into_iter()
            .collect()
    }
}

impl NodeEntry {
    /// A node that has not ticked, with `meters` of its own.
    pub(crate) fn new(
        name: &str,
        priority: u32,
        hz: Hz,
        meters: Vec<(String, Meter)>,
        push_age: Option<PushAge>,
    ) -> (Self, TickMeters) {
        let [lateness, tick_time, response] = std::array::from_fn(|_| Meter::new());
        let entry = Self {
            name: name.into(),
            priority,
            counters: Arc::new(NodeCounters::new(hz)),
            lateness: lateness.1,
            tick_time: tick_time.1,
            response: response.1,
            meters,
            push_age,
            remote: false,
            triggers: Arc::default(),
            matching: Match::Each,
            executor: None,
            executor_index: None,
            group: None,
        };
        let recorders = TickMeters {
            lateness: lateness.0,
            tick_time: tick_time.0,
            response: response.0,
        };
        (entry, recorders)
    }

    fn view(&self, hz: Hz, now: Time, read: fn(&Meter) -> Distribution) -> NodeView {
        let counters = &*self.counters;
        NodeView {
            name: self.name.clone(),
            priority: self.priority,
            hz,
            triggers: self.triggers.clone(),
            executor: self.executor,
            ticks: counters.ticks.load(Ordering::Relaxed),
            overruns: counters.overruns.load(Ordering::Relaxed),
            busy: counters.busy.load(Ordering::Relaxed),
            crashed: counters.crashed.load(Ordering::Relaxed),
            remote: self.remote,
            lateness: read(&self.lateness),
            tick_time: read(&self.tick_time),
            response: read(&self.response),
            meters: self
                .meters
                .iter()
                .map(|(name, meter)| MeterView {
                    name: name.clone(),
                    distribution: read(meter),
                })
                .collect(),
            push_age: self.push_age.as_ref().and_then(|age| age.view(now)),
        }
    }
}

impl TopicEntry {
    fn view(&self, now: Time, read: fn(&Meter) -> Distribution) -> TopicView {
        TopicView {
            name: self.name.clone(),
            depth: self.counters.depth.load(Ordering::Relaxed),
            published: self.counters.published.load(Ordering::Relaxed),
            lost: self.counters.lost.load(Ordering::Relaxed),
            overtaken: self.counters.overtaken.load(Ordering::Relaxed),
            in_flight: self.counters.in_flight.load(Ordering::Relaxed),
            lost_lately: self.counters.losses.lately(now),
            flights: self.counters.flights(),
            per_second: self.counters.window.per_second(now),
            newest: self.counters.newest(),
            publishers: self.publishers.clone(),
            subscriptions: self
                .subscriptions
                .iter()
                .map(|subscription| SubscriptionView {
                    node: subscription.node,
                    dropped: subscription.mark.dropped.load(Ordering::Relaxed),
                    dropped_lately: subscription.mark.drops.lately(now),
                    ages: read(&subscription.ages),
                })
                .collect(),
        }
    }
}
