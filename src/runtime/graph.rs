//! Nodes wired to topics.
//!
//! A graph is built by handing nodes the ends of topics, and thereby learns its
//! own shape: who publishes what, who reads it, how often each node ticks.

use thiserror::Error;

use super::{
    command::{ClockKind, Command, Speed},
    depth::Depth,
    node::Node,
    rate::Rate,
    slot::Slot,
    sync::{
        Arc, Mutex,
        atomic::{AtomicU64, Ordering},
        lock,
    },
    tap::{Patience, Tap, Tapped, Tapper},
    telemetry::{
        Journal, Meter, NodeEntry, Observer, Recorder, Shared, Status, SubscriptionEntry,
        TopicEntry,
    },
    time::{Hz, Time},
    topic::{Payload, Publisher, Subscription, Topic},
};

/// A graph that cannot be built as asked.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum GraphError {
    /// Two nodes of one name.
    #[error("there is a node {0:?} already: give each node a name of its own")]
    DuplicateNode(String),
    /// Two different topics of one name.
    #[error(
        "there is another topic {0:?} already: use that one, or give this one a name of its own"
    )]
    DuplicateTopic(String),
}

/// Nodes, the topics between them, and how far their run has come.
///
/// A graph of three nodes or of a thousand is built by the same calls. It holds
/// all state of a run, so it can be handed from one [`Clock`](super::Clock) to
/// another and goes on where it was.
///
/// ```
/// use ratelab::runtime::{Depth, GO_ON, Graph, Hz, Topic};
///
/// let mut graph = Graph::new();
/// let ticks = Topic::new("/ticks", Depth::ONE);
///
/// graph.node("metronome", Hz::new(2.0)?, 0, |wiring| {
///     let output = wiring.publisher(&ticks);
///     move |now| {
///         output.publish("tick", now, None);
///         GO_ON
///     }
/// })?;
/// assert_eq!(graph.observer().snapshot().topics[0].publishers, [0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Graph {
    pub(crate) slots: Vec<Slot>,
    pub(crate) plane: Plane,
}

/// The part of a graph that commands act on and observers see; everything but
/// the nodes themselves, which may be out on their threads.
pub(crate) struct Plane {
    pub(crate) shared: Arc<Shared>,
    pub(crate) status: Status,
    nodes: Vec<NodeEntry>,
    topics: Vec<WiredTopic>,
    pub(crate) patience: Patience,
}

struct WiredTopic {
    entry: TopicEntry,
    queue: Box<dyn Queue>,
}

/// A topic whose payload does not matter.
trait Queue: Send {
    fn set_depth(&self, depth: Depth, now: Time) -> Depth;
}

impl<T: Payload> Queue for Topic<T> {
    fn set_depth(&self, depth: Depth, now: Time) -> Depth {
        Topic::set_depth(self, depth, now)
    }
}

impl Default for Graph {
    fn default() -> Self {
        Self::new()
    }
}

impl Graph {
    /// An empty graph at run time zero.
    pub fn new() -> Self {
        let status = Status {
            clock: ClockKind::Virtual,
            paused: false,
            speed: Speed::FlatOut,
        };
        Self {
            slots: Vec::new(),
            plane: Plane {
                shared: Arc::new(Shared {
                    now: AtomicU64::new(0),
                    status: Mutex::new(status),
                    journal: Journal::default(),
                }),
                status,
                nodes: Vec::new(),
                topics: Vec::new(),
                patience: Patience::default(),
            },
        }
    }

    /// Adds a node that ticks at `hz`. Among nodes that are due at the same
    /// instant of virtual time the one with the lowest `priority` runs first,
    /// and of equals the one that was added first. `build` is given the
    /// [`Wiring`] from which the node takes its ends of topics.
    ///
    /// # Errors
    /// [`GraphError`] if the name is taken, or if a topic was used whose name
    /// belongs to another one. The graph is then unchanged.
    pub fn node<N: Node + 'static>(
        &mut self,
        name: &str,
        hz: Hz,
        priority: u32,
        build: impl FnOnce(&mut Wiring<'_>) -> N,
    ) -> Result<(), GraphError> {
        if self.plane.nodes.iter().any(|node| &*node.name == name) {
            return Err(GraphError::DuplicateNode(name.to_owned()));
        }
        let mut wiring = Wiring::new(&self.plane.topics, self.slots.len());
        let node = Box::new(build(&mut wiring));
        let Wiring { ends, meters, .. } = wiring;
        self.plane.connect(ends)?;
        let slot = Slot::new(name, priority, Rate::new(hz, self.now()), node, meters);
        self.plane.nodes.push(slot.entry.clone());
        self.slots.push(slot);
        Ok(())
    }

    /// Copies every message of `topic` from now on; see [`Tapper::topic`].
    pub fn tap<T: Payload>(&self, topic: &Topic<T>, capacity: usize) -> Tap<Tapped<T>> {
        self.tapper().topic(topic, capacity)
    }

    /// Taps topics and nodes, also when the graph is running already. Knows the
    /// nodes that the graph has at this moment.
    pub fn tapper(&self) -> Tapper {
        Tapper {
            patience: self.plane.patience.clone(),
            nodes: self.slots.iter().map(|slot| slot.taps.clone()).collect(),
        }
    }

    /// Reads the graph from any thread while it runs. Knows the nodes and
    /// topics that the graph has at this moment.
    pub fn observer(&self) -> Observer {
        Observer {
            shared: self.plane.shared.clone(),
            nodes: self.plane.nodes.clone(),
            topics: self.plane.topics.iter().map(|t| t.entry.clone()).collect(),
        }
    }

    /// How far the run has come.
    pub fn now(&self) -> Time {
        self.plane.now()
    }

    /// Sets under which clock the graph is about to run, for those who observe
    /// it before it does.
    pub fn set_clock(&mut self, clock: ClockKind) {
        self.plane.update(|status| status.clock = clock);
    }

    /// Sets how fast the virtual clock will run the graph.
    pub fn set_speed(&mut self, speed: Speed) {
        self.plane.update(|status| status.speed = speed);
    }

    /// Lets `node` obey a command that is for it; see [`Slot::obey`].
    pub(crate) fn obey(
        &mut self,
        node: &str,
        command: &Command,
        at: Time,
    ) -> Result<String, String> {
        let index = self.plane.node_index(node)?;
        self.slots[index].obey(command, at)
    }
}

impl Plane {
    pub(crate) fn now(&self) -> Time {
        Time::from_nanos(self.shared.now.load(Ordering::Relaxed))
    }

    pub(crate) fn set_now(&self, now: Time) {
        self.shared.now.store(now.as_nanos(), Ordering::Relaxed);
    }

    pub(crate) fn journal(&self) -> &Journal {
        &self.shared.journal
    }

    pub(crate) fn update(&mut self, change: impl FnOnce(&mut Status)) {
        change(&mut self.status);
        *lock(&self.shared.status) = self.status;
    }

    pub(crate) fn node_index(&self, name: &str) -> Result<usize, String> {
        let known = self.nodes.iter().position(|node| &*node.name == name);
        let names = self.nodes.iter().map(|node| &*node.name);
        known.ok_or_else(|| nothing_called("node", name, names))
    }

    pub(crate) fn set_depth(&self, topic: &str, depth: Depth, now: Time) -> Result<Depth, String> {
        let known = self.topics.iter().find(|t| &*t.entry.name == topic);
        let names = self.topics.iter().map(|t| &*t.entry.name);
        let wired = known.ok_or_else(|| nothing_called("topic", topic, names))?;
        Ok(wired.queue.set_depth(depth, now))
    }

    /// Adds the edges that a node took, and the topics first seen with them.
    fn connect(&mut self, ends: Vec<End>) -> Result<(), GraphError> {
        let mut names: Vec<Arc<str>> = Vec::new();
        for topic in ends.iter().filter_map(|end| end.new_topic.as_ref()) {
            let taken = self.topics.iter().map(|t| &t.entry.name).chain(&names);
            if taken.into_iter().any(|name| *name == topic.entry.name) {
                return Err(GraphError::DuplicateTopic(topic.entry.name.to_string()));
            }
            names.push(topic.entry.name.clone());
        }
        for end in ends {
            self.topics.extend(end.new_topic);
            let entry = &mut self.topics[end.topic].entry;
            match end.kind {
                EndKind::Publisher(node) => entry.publishers.push(node),
                EndKind::Subscription(subscription) => entry.subscriptions.push(subscription),
            }
        }
        Ok(())
    }
}

/// Says that there is no `kind` of this name, and which there are.
fn nothing_called<'n>(kind: &str, name: &str, known: impl Iterator<Item = &'n str>) -> String {
    match known.collect::<Vec<_>>().join(", ").as_str() {
        "" => format!("there is no {kind} {name:?}: the graph has none"),
        known => format!("there is no {kind} {name:?}: expected one of {known}"),
    }
}

/// From what a node takes its ends of topics while it is being built, so that the
/// graph knows who is connected to what.
///
/// ```
/// use ratelab::runtime::{Depth, GO_ON, Graph, Hz, Topic};
///
/// let (range, alarm) = (Topic::new("/range", Depth::ONE), Topic::new("/alarm", Depth::ONE));
/// let mut graph = Graph::new();
/// graph.node("watch", Hz::new(20.0)?, 0, |wiring| {
///     let mut range = wiring.subscription::<f64>(&range);
///     let alarm = wiring.publisher(&alarm);
///     let mut delay = wiring.meter("sense→alarm");
///     move |now| {
///         if let Some(near) = range.latest(now).filter(|range| range.data < 0.5) {
///             alarm.publish((), now, Some(near.stamp));
///             delay.record(now - near.stamp);
///         }
///         GO_ON
///     }
/// })?;
/// let topics = graph.observer().shape().topics;
/// assert_eq!((topics[0].name.as_str(), &topics[0].readers[..]), ("/range", &[0][..]));
/// assert_eq!((topics[1].name.as_str(), &topics[1].publishers[..]), ("/alarm", &[0][..]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Wiring<'g> {
    known: &'g [WiredTopic],
    node: usize,
    ends: Vec<End>,
    meters: Vec<(String, Meter)>,
}

/// One edge to be: an end of the topic with index `topic`, which comes along if
/// the graph has not seen it before.
struct End {
    topic: usize,
    new_topic: Option<WiredTopic>,
    kind: EndKind,
}

enum EndKind {
    Publisher(usize),
    Subscription(SubscriptionEntry),
}

impl<'g> Wiring<'g> {
    fn new(known: &'g [WiredTopic], node: usize) -> Self {
        Self {
            known,
            node,
            ends: Vec::new(),
            meters: Vec::new(),
        }
    }

    /// The node publishes to `topic`.
    pub fn publisher<T: Payload>(&mut self, topic: &Topic<T>) -> Publisher<T> {
        let kind = EndKind::Publisher(self.node);
        self.end(topic, kind);
        topic.publisher()
    }

    /// The node reads from `topic`.
    pub fn subscription<T: Payload>(&mut self, topic: &Topic<T>) -> Subscription<T> {
        let subscription = topic.subscribe();
        let kind = EndKind::Subscription(SubscriptionEntry {
            node: self.node,
            mark: subscription.mark(),
            ages: subscription.ages(),
        });
        self.end(topic, kind);
        subscription
    }

    /// The node measures a duration of its own, shown under `name` to whoever
    /// observes the graph.
    pub fn meter(&mut self, name: &str) -> Recorder {
        let (recorder, meter) = Meter::new();
        self.meters.push((name.to_owned(), meter));
        recorder
    }

    fn end<T: Payload>(&mut self, topic: &Topic<T>, kind: EndKind) {
        let counters = topic.counters();
        let fresh = self.ends.iter().filter_map(|end| end.new_topic.as_ref());
        let mut topics = self.known.iter().chain(fresh);
        let position = topics.position(|t| Arc::ptr_eq(&t.entry.counters, &counters));
        let count = self.known.len() + self.ends.iter().filter(|e| e.new_topic.is_some()).count();
        let new_topic = position.is_none().then(|| WiredTopic {
            entry: TopicEntry {
                name: topic.name().into(),
                counters,
                publishers: Vec::new(),
                subscriptions: Vec::new(),
            },
            queue: Box::new(topic.clone()),
        });
        self.ends.push(End {
            topic: position.unwrap_or(count),
            new_topic,
            kind,
        });
    }
}
