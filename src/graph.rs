//! Nodes wired to topics.
//!
//! A graph is built by giving nodes the ends of topics, and thereby learns its own
//! structure: publishers and readers of each topic, and the rate of each node.

mod executors;
mod triggers;

use std::convert::Infallible;

use thiserror::Error;

use super::{
    command::{ClockKind, Speed},
    depth::Depth,
    knob::{Knob, KnobKind},
    message::Payload,
    node::{GO_ON, Node},
    outbox::Outbox,
    rate::Rate,
    record::{MeterRecorder, PushRecorder, Records, Sink},
    release::Release,
    scheduling::{Again, Crew, Fixed, Kit, Member, Plain, Seat, Stage, TaskSpec, Wired},
    state::{RunState, Status},
    sync::{Arc, Mutex, get_mut, lock},
    time::{HzError, Time},
    topic::{Publisher, ReadMark, Subscription, Topic},
    topology::{NodeTopology, TopicTopology, Topology, each},
    trigger::{Arrival, Arrivals},
};

/// An error while building a graph.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum GraphError {
    /// Two nodes with the same name.
    #[error("there is a node {0:?} already: give each node a name of its own")]
    DuplicateNode(String),
    /// Two different topics with the same name.
    #[error(
        "there is another topic {0:?} already: use that one, or give this one a name of its own"
    )]
    DuplicateTopic(String),
    /// Messages are to trigger a node, but no topic does.
    #[error("no topic triggers {0:?}: take one with Wiring::trigger, or give the node a rate")]
    NoTrigger(String),
    /// A topic is to trigger a node at a rate.
    #[error("{0:?} ticks at a rate, and a topic is to trigger it: choose one of the two")]
    TriggerAtRate(String),
    /// Nodes trigger each other without end.
    #[error("nodes trigger each other in a circle: {0}; let one of them tick at a rate")]
    TriggerCycle(String),
    /// An executor is to have a node that the graph lacks.
    #[error("there is no node {0:?} for the executor {1}: add the node first")]
    UnknownCallback(String, String),
    /// An executor is to have a node of another executor.
    #[error("{0:?} has an executor already: give each node one")]
    SecondExecutor(String),
    /// An executor is to have a node whose schedule it does not know.
    #[error("the executor {1} does not know the schedule of {0:?}: leave the node on its own")]
    ForeignSchedule(String, String),
    /// A number that is not a rate.
    #[error(transparent)]
    Rate(#[from] HzError),
    /// A node that messages trigger is to have a rule that needs a period.
    #[error("messages trigger {0:?}, so it has no period for {1}: {2}")]
    NoPeriod(String, String, &'static str),
}

impl From<Infallible> for GraphError {
    fn from(never: Infallible) -> Self {
        match never {}
    }
}

/// Nodes, the topics between them, and the progress of their run.
///
/// A graph of three nodes or of a thousand is built by the same calls. It holds all state
/// of a run, so it can be handed over from one [`Clock`](super::Clock) to another and
/// continues there.
///
/// ```
/// use ratelab::{Depth, GO_ON, Graph, Hz, Topic};
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
/// assert_eq!(graph.topology().topics[0].publishers, [0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Graph {
    /// The nodes, by their indices.
    pub(crate) seats: Vec<Mutex<Seat>>,
    pub(crate) stage: Stage,
    pub(crate) control: ControlPlane,
    /// [`Clock::cores`](super::Clock::cores) of the real clock, once it is known.
    pub(crate) cores: Option<usize>,
}

/// The part of a graph that commands change and observers read: everything except the
/// nodes, which may be away on their threads.
pub(crate) struct ControlPlane {
    pub(crate) state: Arc<RunState>,
    pub(crate) status: Status,
    nodes: Vec<NodeEntry>,
    topics: Vec<WiredTopic>,
    records: Records,
    /// The seed of every random draw.
    seed: u64,
    kit: Box<dyn Kit>,
}

/// A node as the graph knows it.
struct NodeEntry {
    topology: NodeTopology,
    /// Whether it runs in another process.
    remote: bool,
}

struct WiredTopic {
    name: Arc<str>,
    /// Number of its bus, the same for each handle.
    address: usize,
    /// Indices of the nodes that publish to it.
    publishers: Vec<usize>,
    /// Indices of the nodes that read from it.
    readers: Vec<usize>,
    topic: Box<dyn AnyTopic>,
}

/// A topic, regardless of its payload.
trait AnyTopic: Send {
    /// Changes a knob of the topic; returns the value before.
    fn turn(&self, knob: &Knob, kit: (&dyn Kit, u64), now: Time) -> Result<String, String>;

    fn depth(&self) -> Depth;

    /// Sends its records on this way.
    fn set_records(&self, records: Records);

    /// Delivers the messages that arrive by `now`.
    fn deliver(&self, now: Time);

    /// The messages in flight that arrive after `now`, for the nodes that they trigger.
    fn arrivals_after(&self, now: Time) -> Vec<Arrival>;
}

impl<T: Payload> AnyTopic for Topic<T> {
    fn turn(&self, knob: &Knob, kit: (&dyn Kit, u64), now: Time) -> Result<String, String> {
        match knob {
            Knob::Depth { depth, .. } => Ok(self.set_depth(*depth, now).to_string()),
            Knob::Read { order, .. } => Ok(self.set_order(*order).to_string()),
            knob => self.turn_channel(knob, kit, now),
        }
    }

    fn depth(&self) -> Depth {
        Topic::depth(self)
    }

    fn set_records(&self, records: Records) {
        Topic::set_records(self, records);
    }

    fn deliver(&self, now: Time) {
        Topic::deliver(self, now);
    }

    fn arrivals_after(&self, now: Time) -> Vec<Arrival> {
        Topic::arrivals_after(self, now)
    }
}

impl Default for Graph {
    fn default() -> Self {
        Self::new()
    }
}

impl Graph {
    /// An empty graph at run time zero, whose nodes tick at their rates.
    pub fn new() -> Self {
        Self::with(Plain)
    }

    /// The same with what this `kit` gives its nodes.
    pub fn with(kit: impl Kit + 'static) -> Self {
        let status = Status {
            clock: ClockKind::Virtual,
            paused: false,
            speed: Speed::Unlimited,
        };
        Self {
            seats: Vec::new(),
            stage: Stage::default(),
            control: ControlPlane {
                state: Arc::new(RunState::new(status)),
                status,
                nodes: Vec::new(),
                topics: Vec::new(),
                records: Records::default(),
                seed: 0,
                kit: Box::new(kit),
            },
            cores: Some(usize::MAX),
        }
    }

    /// A topic for nodes of this graph, which keeps its newest message.
    pub fn topic<T: Payload>(&self, name: &str) -> Topic<T> {
        Topic::new(name, Depth::ONE)
    }

    /// Adds a node that ticks at a rate (Hz), or on messages; see [`Release`]. Among nodes that
    /// are due at the same instant of virtual time the one with the lowest `priority` runs
    /// first, and of equals the one added first. `build` receives the [`Wiring`] from which the
    /// node takes its ends of topics.
    ///
    /// # Errors
    /// [`GraphError`] if the name is taken, if two different topics share a name, if the release is
    /// not valid, or if nodes would trigger each other in a circle. The graph is then unchanged.
    pub fn node<N: Node + 'static, R: TryInto<Release>>(
        &mut self,
        name: &str,
        release: R,
        priority: u32,
        build: impl FnOnce(&mut Wiring<'_>) -> N,
    ) -> Result<(), GraphError>
    where
        GraphError: From<R::Error>,
    {
        self.add(name, release.try_into()?, priority, false, build)
            .map(drop)
    }

    /// Adds a node as [`Graph::node`] does; a restart calls `build` once more, and sends the
    /// new node its `message`.
    ///
    /// # Errors
    /// As of [`Graph::node`].
    pub fn restartable_node<N: Node + 'static, R: TryInto<Release>>(
        &mut self,
        name: &str,
        release: R,
        priority: u32,
        mut build: impl FnMut(&mut Wiring<'_>) -> N + Send + 'static,
        message: Option<&str>,
    ) -> Result<(), GraphError>
    where
        GraphError: From<R::Error>,
    {
        let ends = self.add(name, release.try_into()?, priority, false, &mut build)?;
        if let Some(seat) = self.seats.last_mut() {
            get_mut(seat).again = Some(Again {
                build: Box::new(move || Box::new(build(&mut Wiring::again(ends.clone())))),
                message: message.map(str::to_owned),
            });
        }
        Ok(())
    }

    /// Adds a node that runs in another process: the graph learns its name, its rate and
    /// its topics from `build`, and never ticks it.
    ///
    /// # Errors
    /// As of [`Graph::node`].
    pub fn remote_node<N: Node + 'static, R: TryInto<Release>>(
        &mut self,
        name: &str,
        release: R,
        priority: u32,
        build: impl FnOnce(&mut Wiring<'_>) -> N,
    ) -> Result<(), GraphError>
    where
        GraphError: From<R::Error>,
    {
        let wire = |wiring: &mut Wiring<'_>| {
            // Its ends of topics are of no use here, and go at once.
            drop(build(wiring));
            |_: Time| GO_ON
        };
        self.add(name, release.try_into()?, priority, true, wire)?;
        Ok(())
    }

    /// Adds a node, and returns the ends that it took.
    fn add<N: Node + 'static>(
        &mut self,
        name: &str,
        release: Release,
        priority: u32,
        remote: bool,
        build: impl FnOnce(&mut Wiring<'_>) -> N,
    ) -> Result<Ends, GraphError> {
        if self.control.nodes.iter().any(|node| node.name() == name) {
            return Err(GraphError::DuplicateNode(name.to_owned()));
        }
        let (arrivals, index) = (self.stage.arrivals(), self.seats.len());
        let records = self.control.records.of(index);
        let mut wiring = Wiring::new(&self.control.topics, arrivals, records.clone());
        let node = Box::new(build(&mut wiring));
        let Wiring {
            endpoints,
            wired,
            subscriptions,
            ..
        } = wiring;
        let ends = Ends {
            subscriptions,
            records: records.clone(),
            meters: wired.meters.clone(),
            outbox: wired.outbox.clone(),
        };
        let triggers = triggers::check(name, &release, &endpoints, &self.control)?;
        self.control.connect(endpoints)?;
        let mut entry = NodeEntry::new(name, priority, &release, triggers, wired.meters);
        entry.remote = remote;
        self.control.nodes.push(entry);
        let (now, name) = (self.now(), Arc::<str>::from(name));
        let spec = TaskSpec {
            name: name.clone(),
            seed: self.control.seed,
            rate: Rate::new(release.hz(), now),
            inputs: wired.intakes,
        };
        let inputs = spec.inputs.len();
        let scheduler = match &release {
            Release::Every(_) => self.control.kit.scheduler(spec),
            Release::On(matching) => matching.scheduler(spec),
        };
        let member = Member {
            node: index,
            name: name.clone(),
            inputs,
            priority,
            remote,
            records: records.clone(),
            outbox: wired.outbox.clone(),
        };
        self.stage.add(Crew::of(scheduler, member));
        let seat = Seat::new(name, records, node, wired.outbox, wired.fixed);
        self.seats.push(Mutex::new(seat));
        Ok(ends)
    }

    /// The sink of the graph's records; if it has none, what `make` returns from now on. A graph
    /// has one sink for all of its life.
    pub fn sink_or(&self, make: impl FnOnce() -> Arc<dyn Sink>) -> Arc<dyn Sink> {
        self.control.records.sink_or(make)
    }

    /// The state of the run, for reading it from any thread.
    pub fn state(&self) -> Arc<RunState> {
        self.control.state.clone()
    }

    /// The nodes, topics and connections, with their rates and depths in force.
    pub fn topology(&self) -> Topology {
        let nodes = self.control.nodes.iter();
        let topics = self.control.topics.iter();
        let mut topology = Topology {
            nodes: nodes.map(|node| node.topology.clone()).collect(),
            topics: topics.map(WiredTopic::topology).collect(),
        };
        let rates = topology.rates(|node| self.stage.state(node, self.now()).hz);
        let nodes = topology.nodes.iter_mut().zip(rates);
        nodes.for_each(|(node, hz)| node.hz = hz);
        topology
    }

    /// Number of its nodes.
    pub fn node_count(&self) -> usize {
        self.seats.len()
    }

    /// Whether this process runs the node with this index.
    pub fn is_here(&self, node: usize) -> bool {
        self.control
            .nodes
            .get(node)
            .is_some_and(|node| !node.remote)
    }

    /// Whether the node with this index crashed without a restart since.
    pub fn is_crashed(&self, node: usize) -> bool {
        node < self.seats.len() && self.stage.state(node, self.now()).crashed
    }

    /// Current run time.
    pub fn now(&self) -> Time {
        self.control.now()
    }

    /// Sets the clock that runs the graph from now on. Virtual time waits for those
    /// who look on.
    pub fn set_clock(&mut self, clock: ClockKind) {
        self.control.update(|status| status.clock = clock);
        self.control.state.set_waits(clock == ClockKind::Virtual);
    }

    /// Sets the speed of the virtual clock.
    pub fn set_speed(&mut self, speed: Speed) {
        self.control.update(|status| status.speed = speed);
    }

    /// Stops run time, or lets it go on.
    pub fn set_paused(&mut self, paused: bool) {
        self.control.update(|status| status.paused = paused);
    }

    /// Sets the seed of all random durations, before nodes are added.
    pub fn set_seed(&mut self, seed: u64) {
        self.control.seed = seed;
    }

    /// Checks that the knob exists and that everything its value needs is loaded.
    ///
    /// # Errors
    /// The reason, with the available alternatives.
    pub fn check(&self, knob: &Knob) -> Result<(), String> {
        match knob {
            knob if knob.kind().is_of_topic() => self.control.check(knob),
            knob => {
                let index = self.control.node_index(knob.target())?;
                match self.is_here(index) {
                    true => self.stage.check(index, &lock(&self.seats[index]), knob),
                    false => Ok(()),
                }
            }
        }
    }

    /// Turns a knob between two runs, or before the first; returns the value before.
    ///
    /// # Errors
    /// The reason and a remedy; nothing is changed then.
    pub fn turn(&mut self, knob: &Knob) -> Result<String, String> {
        let now = self.now();
        match knob.kind().is_of_topic() {
            true => self.control.turn(knob, now),
            false => self.turn_node(knob, now),
        }
    }

    /// Turns a knob of a node at run time `at`; returns the value before.
    ///
    /// # Errors
    /// The reason and a remedy.
    pub(crate) fn turn_node(&mut self, knob: &Knob, at: Time) -> Result<String, String> {
        let index = self.control.node_index(knob.target())?;
        match self.is_here(index) {
            true => {
                let seat = get_mut(&mut self.seats[index]);
                self.stage.turn(index, seat, knob, at)
            }
            // A setting for the process in which it runs.
            false => Ok(String::new()),
        }
    }
}

impl ControlPlane {
    pub(crate) fn now(&self) -> Time {
        self.state.now()
    }

    pub(crate) fn set_now(&self, now: Time) {
        self.state.set_now(now);
    }

    pub(crate) fn update(&mut self, change: impl FnOnce(&mut Status)) {
        change(&mut self.status);
        self.state.update(|status| *status = self.status);
    }

    pub(crate) fn node_index(&self, name: &str) -> Result<usize, String> {
        let known = self.nodes.iter().position(|node| node.name() == name);
        let names = self.nodes.iter().map(NodeEntry::name);
        known.ok_or_else(|| nothing_called("node", name, names))
    }

    /// Name of the node with this index.
    pub(crate) fn name(&self, node: usize) -> &str {
        self.nodes[node].name()
    }

    /// Whether some of the nodes run in other processes.
    pub(crate) fn is_part(&self) -> bool {
        self.nodes.iter().any(|node| node.remote)
    }

    /// The index of a node called `name` that runs here.
    ///
    /// # Errors
    /// The reason, with the available alternatives.
    pub(crate) fn local_index(&self, name: &str) -> Result<usize, String> {
        let index = self.node_index(name)?;
        match self.nodes[index].remote {
            true => Err(format!("{name} runs in another process")),
            false => Ok(index),
        }
    }

    /// Changes a knob of a topic at run time `now`; returns the value before.
    ///
    /// # Errors
    /// The reason, with the available alternatives.
    pub(crate) fn turn(&self, knob: &Knob, now: Time) -> Result<String, String> {
        self.check(knob)?;
        let topic = &self.topic(knob.target())?.topic;
        topic.turn(knob, (&*self.kit, self.seed), now)
    }

    /// Checks that the topic has this knob.
    fn check(&self, knob: &Knob) -> Result<(), String> {
        let topic = self.topic(knob.target())?;
        let read = !topic.readers.is_empty();
        if read || knob.kind() == KnobKind::Depth {
            return self.check_value(knob);
        }
        let names = self.topics.iter().filter(|t| !t.readers.is_empty());
        let names: Vec<&str> = names.map(|t| &*t.name).collect();
        let name = &topic.name;
        Err(match &names[..] {
            [] => format!("{name} has no reader, and no topic has one: let a node read it first"),
            names => format!("{name} has no reader: expected one of {}", names.join(", ")),
        })
    }

    /// Checks the value of a knob of a topic.
    fn check_value(&self, knob: &Knob) -> Result<(), String> {
        if matches!(knob, Knob::Depth { .. } | Knob::Read { .. }) {
            return Ok(());
        }
        let channel = self.kit.channel(knob.target(), self.seed);
        let mut channel = channel.ok_or_else(|| knob.not_in_kit())?;
        channel.turn(knob).map(drop)
    }

    /// Delivers the messages of all topics that arrive by `now`.
    pub(crate) fn deliver(&self, now: Time) {
        self.topics
            .iter()
            .for_each(|topic| topic.topic.deliver(now));
    }

    /// The messages in flight on all topics that arrive after `now`, for the nodes that they
    /// trigger, in the order of arrival.
    pub(crate) fn arrivals_after(&self, now: Time) -> Vec<Arrival> {
        let topics = self.topics.iter();
        let mut arrivals: Vec<Arrival> = topics
            .flat_map(|topic| topic.topic.arrivals_after(now))
            .collect();
        arrivals.sort_by_key(|arrival| arrival.at);
        arrivals
    }

    fn topic(&self, name: &str) -> Result<&WiredTopic, String> {
        let known = self.topics.iter().find(|t| &*t.name == name);
        let names = self.topics.iter().map(|t| &*t.name);
        known.ok_or_else(|| nothing_called("topic", name, names))
    }

    /// Adds the edges of a node, and the topics that are new with them.
    fn connect(&mut self, endpoints: Vec<Endpoint>) -> Result<(), GraphError> {
        let mut names: Vec<Arc<str>> = Vec::new();
        for topic in endpoints
            .iter()
            .filter_map(|endpoint| endpoint.new_topic.as_ref())
        {
            let taken = self.topics.iter().map(|t| &t.name).chain(&names);
            if taken.into_iter().any(|name| *name == topic.name) {
                return Err(GraphError::DuplicateTopic(topic.name.to_string()));
            }
            names.push(topic.name.clone());
        }
        for endpoint in endpoints {
            if let Some(new) = endpoint.new_topic {
                new.topic.set_records(self.records.of(self.topics.len()));
                self.topics.push(new);
            }
            let topic = &mut self.topics[endpoint.topic];
            match endpoint.kind {
                EndpointKind::Publisher(node) => topic.publishers.push(node),
                EndpointKind::Subscription(node) => topic.readers.push(node),
            }
        }
        Ok(())
    }
}

impl NodeEntry {
    fn new(
        name: &str,
        priority: u32,
        release: &Release,
        triggers: Vec<usize>,
        meters: Vec<String>,
    ) -> Self {
        Self {
            topology: NodeTopology {
                name: name.to_owned(),
                priority,
                hz: release.hz(),
                triggers,
                matching: match release {
                    Release::Every(_) => each(),
                    Release::On(matching) => matching.to_string(),
                },
                executor: None,
                executor_index: None,
                group: None,
                meters,
            },
            remote: false,
        }
    }

    fn name(&self) -> &str {
        &self.topology.name
    }
}

impl WiredTopic {
    fn topology(&self) -> TopicTopology {
        TopicTopology {
            name: self.name.to_string(),
            depth: self.topic.depth(),
            publishers: self.publishers.clone(),
            readers: self.readers.clone(),
        }
    }
}

/// An error message for an unknown name of a `kind`, with the known names.
fn nothing_called<'n>(kind: &str, name: &str, known: impl Iterator<Item = &'n str>) -> String {
    match known.collect::<Vec<_>>().join(", ").as_str() {
        "" => format!("there is no {kind} {name:?}: the graph has none"),
        known => format!("there is no {kind} {name:?}: expected one of {known}"),
    }
}

/// Supplies a node with its ends of topics while it is being built, so that the graph
/// records all connections.
///
/// ```
/// use ratelab::{Depth, GO_ON, Graph, Hz, Topic};
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
/// let topics = graph.topology().topics;
/// assert_eq!((topics[0].name.as_str(), &topics[0].readers[..]), ("/range", &[0][..]));
/// assert_eq!((topics[1].name.as_str(), &topics[1].publishers[..]), ("/alarm", &[0][..]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Wiring<'g> {
    known: &'g [WiredTopic],
    /// The way of the node's records.
    records: Records,
    endpoints: Vec<Endpoint>,
    wired: Wired,
    subscriptions: Vec<ReadEnd>,
    /// What the node took that is built once more.
    former: Option<Ends>,
    arrivals: Option<&'g Arc<Arrivals>>,
}

/// What a node took when it was built.
#[derive(Clone)]
struct Ends {
    subscriptions: Vec<ReadEnd>,
    records: Records,
    meters: Vec<String>,
    outbox: Arc<Outbox>,
}

/// The read position of a subscription.
#[derive(Clone)]
struct ReadEnd {
    /// Number of the bus of its topic.
    address: usize,
    mark: Arc<ReadMark>,
}

/// An edge to be added: an end of the topic with index `topic`, together with the topic
/// itself if it is new to the graph.
struct Endpoint {
    topic: usize,
    new_topic: Option<WiredTopic>,
    kind: EndpointKind,
    /// Whether its messages trigger the node.
    triggers: bool,
}

/// The end of a topic that the node with this index has.
enum EndpointKind {
    Publisher(usize),
    Subscription(usize),
}

impl<'g> Wiring<'g> {
    fn new(known: &'g [WiredTopic], arrivals: &'g Arc<Arrivals>, records: Records) -> Self {
        Self {
            arrivals: Some(arrivals),
            ..Self::empty(known, records)
        }
    }

    fn empty(known: &'g [WiredTopic], records: Records) -> Self {
        Self {
            known,
            records,
            endpoints: Vec::new(),
            wired: Wired::default(),
            subscriptions: Vec::new(),
            former: None,
            arrivals: None,
        }
    }

    /// Hands out the `former` ends of a node that is built once more.
    fn again(former: Ends) -> Self {
        let mut wiring = Self::empty(&[], former.records.clone());
        wiring.wired.meters.clone_from(&former.meters);
        wiring.former = Some(former);
        wiring
    }

    /// Connects the node as a publisher of `topic`.
    pub fn publisher<T: Payload>(&mut self, topic: &Topic<T>) -> Publisher<T> {
        if let Some(former) = &self.former {
            return topic.publisher_through(&former.outbox);
        }
        let kind = EndpointKind::Publisher(self.records.index());
        self.add_endpoint(topic, kind);
        topic.publisher_through(&self.wired.outbox)
    }

    /// Connects the node as a reader of `topic`.
    pub fn subscription<T: Payload>(&mut self, topic: &Topic<T>) -> Subscription<T> {
        if let Some(mark) = self.former_subscription(topic) {
            return topic.subscribe_again(mark);
        }
        let subscription = topic.subscribe_as(Some(self.next_reader(topic)));
        self.subscribe(topic, &subscription);
        subscription
    }

    /// Connects the node as a reader of `topic`, whose messages trigger it; see
    /// [`Release::On`]. Each message counts once: in a tick the subscription reads the one
    /// that the tick is for, whatever the read order of the topic.
    ///
    /// ```
    /// use ratelab::{Depth, GO_ON, Graph, Topic};
    /// use ratelab_effects::Match;
    ///
    /// let (left, right) = (Topic::new("/left", Depth::ONE), Topic::new("/right", Depth::ONE));
    /// let mut graph = Graph::new();
    /// graph.node("stereo", "exact:10".parse::<Match>()?, 0, |wiring| {
    ///     let mut left = wiring.trigger::<u64>(&left);
    ///     let mut right = wiring.trigger::<u64>(&right);
    ///     move |now| {
    ///         let (left, right) = (left.latest(now), right.latest(now));
    ///         assert_eq!(left.map(|left| left.stamp), right.map(|right| right.stamp));
    ///         GO_ON
    ///     }
    /// })?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn trigger<T: Payload>(&mut self, topic: &Topic<T>) -> Subscription<T> {
        let Some(arrivals) = self.arrivals else {
            return self.subscription(topic);
        };
        let (node, input) = (self.records.index(), self.wired.intakes.len());
        let reader = self.next_reader(topic);
        let (subscription, intake) = topic.trigger(node, input, reader, arrivals);
        self.wired.intakes.push(intake);
        self.subscribe(topic, &subscription);
        if let Some(endpoint) = self.endpoints.last_mut() {
            endpoint.triggers = true;
        }
        subscription
    }

    fn subscribe<T: Payload>(&mut self, topic: &Topic<T>, subscription: &Subscription<T>) {
        self.subscriptions.push(ReadEnd {
            address: topic.address(),
            mark: subscription.mark(),
        });
        let kind = EndpointKind::Subscription(self.records.index());
        self.add_endpoint(topic, kind);
    }

    /// Adds a duration that the node measures, shown under `name`.
    pub fn meter(&mut self, name: &str) -> MeterRecorder {
        let meters = &mut self.wired.meters;
        let former = self.former.as_ref();
        let known = former.and_then(|_| meters.iter().position(|known| known == name));
        let index = known.unwrap_or_else(|| {
            meters.push(name.to_owned());
            meters.len() - 1
        });
        MeterRecorder::new(self.records.clone(), index)
    }

    /// Declares that the node acts on the world outside of the graph; it records the age
    /// of the sensing behind each push.
    pub fn push_age(&mut self) -> PushRecorder {
        PushRecorder::new(self.records.clone())
    }

    /// Removes the knobs of these `kinds` from the node; the refusal shows the `reason`.
    pub fn fix(&mut self, kinds: &'static [KnobKind], reason: &'static str) {
        self.wired.fixed = Fixed { kinds, reason };
    }

    /// The next position from which the former node read `topic`.
    fn former_subscription<T: Payload>(&mut self, topic: &Topic<T>) -> Option<Arc<ReadMark>> {
        let subscriptions = &mut self.former.as_mut()?.subscriptions;
        let address = topic.address();
        let place = subscriptions
            .iter()
            .position(|end| end.address == address)?;
        Some(subscriptions.remove(place).mark)
    }

    /// The place of the next reader among those of `topic`.
    fn next_reader<T: Payload>(&self, topic: &Topic<T>) -> usize {
        let address = topic.address();
        let known = self.known.iter().find(|known| known.address == address);
        let own = self.subscriptions.iter();
        let own = own.filter(|end| end.address == address).count();
        known.map_or(0, |known| known.readers.len()) + own
    }

    fn add_endpoint<T: Payload>(&mut self, topic: &Topic<T>, kind: EndpointKind) {
        let address = topic.address();
        let fresh = || {
            let endpoints = self.endpoints.iter();
            endpoints.filter_map(|endpoint| endpoint.new_topic.as_ref())
        };
        let position = {
            let mut topics = self.known.iter().chain(fresh());
            topics.position(|known| known.address == address)
        };
        let count = self.known.len() + fresh().count();
        let new_topic = position.is_none().then(|| WiredTopic {
            name: topic.name().into(),
            address,
            publishers: Vec::new(),
            readers: Vec::new(),
            topic: Box::new(topic.clone()),
        });
        self.endpoints.push(Endpoint {
            topic: position.unwrap_or(count),
            new_topic,
            kind,
            triggers: false,
        });
    }
}
