//! Snapshots of a running graph.

use std::time::Duration;

use super::{
    Distribution, Event, EventLog, Meter, MeterRecorder, NodeCounters, PushAge, PushAgeView,
    ReadMark, TopicCounters,
};
use crate::runtime::{
    command::{ClockKind, Speed},
    sync::{
        Arc, Mutex,
        atomic::{AtomicU64, Ordering},
        lock,
    },
    time::{Hz, Time},
};

/// How a graph is being run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Status {
    /// The clock that runs it, or ran it last.
    pub clock: ClockKind,
    /// Whether run time stands still by command.
    pub paused: bool,
    /// How fast the virtual clock lets run time pass.
    pub speed: Speed,
}

/// State of a run that its clock writes and observers read.
#[derive(Debug)]
pub(crate) struct Shared {
    pub(crate) now: AtomicU64,
    pub(crate) status: Mutex<Status>,
    pub(crate) log: EventLog,
}

impl Shared {
    /// Run time has come to `now` at least.
    pub(crate) fn advance_to(&self, now: Time) {
        self.now.fetch_max(now.as_nanos(), Ordering::Relaxed);
    }
}

/// A node as the graph and its observers know it.
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
}

/// The writing side of what is measured of a node's ticks.
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

/// A topic as the graph and its observers know it.
#[derive(Clone, Debug)]
pub(crate) struct TopicEntry {
    pub(crate) name: Arc<str>,
    pub(crate) counters: Arc<TopicCounters>,
    pub(crate) publishers: Vec<usize>,
    pub(crate) subscriptions: Vec<SubscriptionEntry>,
}

/// One subscription as the graph and its observers know it.
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
/// use ratelab::runtime::{Clock, GO_ON, Graph, Hz, Inbox, Time, VirtualClock};
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
    pub(crate) shared: Arc<Shared>,
    pub(crate) nodes: Vec<NodeEntry>,
    pub(crate) topics: Vec<TopicEntry>,
}

/// A graph and its counters at one moment: shape and figures, no locks.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// Run time: that of the last tick or command.
    pub now: Time,
    /// How the graph is being run.
    pub status: Status,
    /// The nodes, in the order in which they were added.
    pub nodes: Vec<NodeView>,
    /// The topics, in the order in which nodes were given their ends.
    pub topics: Vec<TopicView>,
}

/// A node in a [`Snapshot`].
#[derive(Clone, Debug)]
pub struct NodeView {
    /// Its name.
    pub name: Arc<str>,
    /// Its place among nodes that are due at the same instant, lowest first.
    pub priority: u32,
    /// The rate in force.
    pub hz: Hz,
    /// Ticks so far.
    pub ticks: u64,
    /// Periods that were skipped because the node was still busy.
    pub overruns: u64,
    /// Whether it is in a tick. In virtual time ticks take none unless asked to.
    pub busy: bool,
    /// Whether it crashed and was not restarted.
    pub crashed: bool,
    /// How late ticks began. In virtual time they are not, unless asked to be.
    pub lateness: Distribution,
    /// How long ticks took: in run time where they were asked to take some, else in
    /// wall time. Else not measured while the virtual clock runs flat out, where
    /// nobody waits for a tick.
    pub tick_time: Distribution,
    /// How long after they were due ticks were over: lateness and tick time.
    pub response: Distribution,
    /// What the node measures of its own.
    pub meters: Vec<MeterView>,
    /// How old the sensing is behind what the node does to the world, if it does
    /// something to it.
    pub push_age: Option<PushAgeView>,
}

/// A node's own measurement in a [`Snapshot`].
#[derive(Clone, Debug)]
pub struct MeterView {
    /// What is measured.
    pub name: String,
    /// The figures.
    pub distribution: Distribution,
}

/// A topic in a [`Snapshot`].
#[derive(Clone, Debug)]
pub struct TopicView {
    /// Its name.
    pub name: Arc<str>,
    /// How many messages it keeps.
    pub depth: usize,
    /// Messages published so far.
    pub published: u64,
    /// Messages that its link lost.
    pub lost: u64,
    /// Messages that its link delivered after a newer one: nobody reads them.
    pub overtaken: u64,
    /// Messages that were on their way when somebody last published or read, or when
    /// the run ended.
    pub in_flight: u64,
    /// Messages per second over the last second.
    pub per_second: f64,
    /// When the newest message was published; `None` before the first.
    pub newest: Option<Time>,
    /// The nodes that publish to it, as indices into [`Snapshot::nodes`].
    pub publishers: Vec<usize>,
    /// Those who read from it.
    pub subscriptions: Vec<SubscriptionView>,
}

impl TopicView {
    /// Messages per second of a run that has come to `now`.
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

    /// Those of them within the last second.
    pub fn dropped_lately(&self) -> u64 {
        self.subscriptions.iter().map(|s| s.dropped_lately).sum()
    }
}

/// A subscription in a [`Snapshot`].
#[derive(Clone, Debug)]
pub struct SubscriptionView {
    /// The node that reads, as an index into [`Snapshot::nodes`].
    pub node: usize,
    /// Messages evicted before it saw them.
    pub dropped: u64,
    /// Those of them within the last second.
    pub dropped_lately: u64,
    /// How old messages were when it read them.
    pub ages: Distribution,
}

impl Snapshot {
    /// The node called `name`.
    pub fn node(&self, name: &str) -> Option<&NodeView> {
        self.nodes.iter().find(|node| &*node.name == name)
    }

    /// What the node called `node` measures of its own under `name`.
    pub fn meter(&self, node: &str, name: &str) -> Option<&Distribution> {
        let meters = &self.node(node)?.meters;
        let meter = meters.iter().find(|meter| meter.name == name)?;
        Some(&meter.distribution)
    }

    /// One period of the node called `name`; zero if there is none.
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
    /// Reads all counters. Those of one topic or node agree among each other
    /// when the graph rests; while it runs each is the newest of its own.
    pub fn snapshot(&self) -> Snapshot {
        self.view(Meter::read)
    }

    /// The same without distributions, which stay empty: reading those is most
    /// of the work, and they change slowly.
    pub fn read_counters(&self) -> Snapshot {
        self.view(|_| Distribution::empty())
    }

    fn view(&self, read: fn(&Meter) -> Distribution) -> Snapshot {
        let now = self.now();
        Snapshot {
            now,
            status: self.status(),
            nodes: self.nodes.iter().map(|node| node.view(now, read)).collect(),
            topics: self
                .topics
                .iter()
                .map(|topic| topic.view(now, read))
                .collect(),
        }
    }

    /// Run time: that of the last tick or command.
    pub fn now(&self) -> Time {
        Time::from_nanos(self.shared.now.load(Ordering::Relaxed))
    }

    /// How the graph is being run.
    pub fn status(&self) -> Status {
        *lock(&self.shared.status)
    }

    /// Commands and ends of the run so far, from number `first` on.
    pub fn events(&self, first: usize) -> Vec<Event> {
        self.shared.log.since(first)
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
        };
        let recorders = TickMeters {
            lateness: lateness.0,
            tick_time: tick_time.0,
            response: response.0,
        };
        (entry, recorders)
    }

    fn view(&self, now: Time, read: fn(&Meter) -> Distribution) -> NodeView {
        let counters = &*self.counters;
        NodeView {
            name: self.name.clone(),
            priority: self.priority,
            hz: Hz::from_micro(counters.micro_hz.load(Ordering::Relaxed)),
            ticks: counters.ticks.load(Ordering::Relaxed),
            overruns: counters.overruns.load(Ordering::Relaxed),
            busy: counters.busy.load(Ordering::Relaxed),
            crashed: counters.crashed.load(Ordering::Relaxed),
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
