//! Nodes wired to topics.
//!
//! A graph is built by giving nodes the ends of topics, and thereby learns its own
//! structure: publishers and readers of each topic, and the rate of each node.

mod executors;
mod triggers;

use thiserror::Error;

use super::{
    command::{ClockKind, Command, Speed},
    executor::Executor,
    knob::{Knob, KnobKind},
    message::Payload,
    millis,
    node::{GO_ON, Node},
    node_knobs,
    outbox::Outbox,
    reexecution::RunLog,
    release::Release,
    scheduling::Stage,
    seat::{Again, Fixed, Seat, Wired},
    sync::{
        Arc, Mutex,
        atomic::{AtomicU64, Ordering},
        lock,
    },
    tap::{Backpressure, Tap, TapMessage},
    tap_handle::TapHandle,
    task::Task,
    telemetry::{
        EventLog, Meter, MeterRecorder, NodeEntry, Observer, PushAge, RunState, Status,
        SubscriptionEntry, TopicCounters, TopicEntry,
    },
    time::Time,
    topic::{Publisher, Subscription, Topic},
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
    UnknownCallback(String, Executor),
    /// An executor is to have a node of another executor.
    #[error("{0:?} has an executor already: give each node one")]
    SecondExecutor(String),
    /// A node that messages trigger is to have a rule that needs a period.
    #[error("messages trigger {0:?}, so it has no period for {1}: {2}")]
    NoPeriod(String, Executor, &'static str),
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
/// assert_eq!(graph.observer().snapshot().topics[0].publishers, [0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Graph {
    /// The nodes, in the order of their schedules in the stage.
    pub(crate) seats: Vec<Seat>,
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
    pub(crate) backpressure: Backpressure,
    /// The seed of every random draw.
    seed: u64,
}

struct WiredTopic {
    entry: TopicEntry,
    topic: Box<dyn AnyTopic>,
}

/// A topic, regardless of its payload.
trait AnyTopic: Send {
    /// Changes a knob of the topic; returns the value before.
    fn turn(&self, knob: &Knob, seed: u64, now: Time) -> Result<String, String>;

    /// Delivers the messages that arrive by `now`.
    fn deliver(&self, now: Time);

    /// The messages in flight that arrive after `now`, for the nodes that they trigger.
    fn arrivals_after(&self, now: Time) -> Vec<Arrival>;
}

impl<T: Payload> AnyTopic for Topic<T> {
    fn turn(&self, knob: &Knob, seed: u64, now: Time) -> Result<String, String> {
        match knob {
            Knob::Depth { depth, .. } => Ok(self.set_depth(*depth, now).to_string()),
            Knob::Link { spec, .. } => Ok(self.set_link(spec.clone(), seed, now).to_string()),
            Knob::Read { order, .. } => Ok(self.set_order(*order).to_string()),
            Knob::Lose { seq, .. } => self.lose(*seq, seed).map(|()| "not lost".to_owned()),
            Knob::Postpone { seq, delay, .. } => {
                let before = self.postpone(*seq, *delay, seed)?;
                Ok(format!("{} ms", millis::to_millis(before)))
            }
            _ => Err(format!("{knob} is not for a topic")),
        }
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
    /// An empty graph at run time zero.
    pub fn new() -> Self {
        let status = Status {
            clock: ClockKind::Virtual,
            paused: false,
            speed: Speed::Unlimited,
        };
        Self {
            seats: Vec::new(),
            stage: Stage::default(),
            control: ControlPlane {
                state: Arc::new(RunState {
                    now: AtomicU64::new(0),
                    status: Mutex::new(status),
                    log: EventLog::default(),
                    threads: RunLog::default(),
                    zero: Mutex::new(None),
                }),
                status,
                nodes: Vec::new(),
                topics: Vec::new(),
                backpressure: Backpressure::default(),
                seed: 0,
            },
            cores: Some(usize::MAX),
        }
    }

    /// Adds a node that ticks at a rate, or on messages; see [`Release`]. Among nodes that
    /// are due at the same instant of virtual time the one with the lowest `priority` runs
    /// first, and of equals the one added first. `build` receives the [`Wiring`] from which the node takes its ends of
    /// topics.
    ///
    /// # Errors
    /// [`GraphError`] if the name is taken, if two different topics share a name, or if
    /// nodes would trigger each other in a circle. The graph is then unchanged.
    pub fn node<N: Node + 'static>(
        &mut self,
        name: &str,
        release: impl Into<Release>,
        priority: u32,
        build: impl FnOnce(&mut Wiring<'_>) -> N,
    ) -> Result<(), GraphError> {
        self.add(name, release, priority, build).map(drop)
    }

    /// Adds a node as [`Graph::node`] does; a restart calls `build` once more, and sends the
    /// new node its `message`.
    ///
    /// # Errors
    /// As of [`Graph::node`].
    pub fn restartable_node<N: Node + 'static>(
        &mut self,
        name: &str,
        release: impl Into<Release>,
        priority: u32,
        mut build: impl FnMut(&mut Wiring<'_>) -> N + Send + 'static,
        message: Option<&str>,
    ) -> Result<(), GraphError> {
        let ends = self.add(name, release, priority, &mut build)?;
        if let Some(seat) = self.seats.last_mut() {
            seat.again = Some(Again {
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
    pub fn remote_node<N: Node + 'static>(
        &mut self,
        name: &str,
        release: impl Into<Release>,
        priority: u32,
        build: impl FnOnce(&mut Wiring<'_>) -> N,
    ) -> Result<(), GraphError> {
        let wire = |wiring: &mut Wiring<'_>| {
            // Its ends of topics are of no use here, and go at once.
            drop(build(wiring));
            |_: Time| GO_ON
        };
        self.add(name, release, priority, wire)?;
        let added = (self.control.nodes.last_mut(), self.seats.last_mut());
        if let (Some(entry), Some(seat)) = added {
            entry.remote = true;
            seat.entry.remote = true;
        }
        Ok(())
    }

    /// Adds a node, and returns the ends that it took.
    fn add<N: Node + 'static>(
        &mut self,
        name: &str,
        release: impl Into<Release>,
        priority: u32,
        build: impl FnOnce(&mut Wiring<'_>) -> N,
    ) -> Result<Ends, GraphError> {
        if self.control.nodes.iter().any(|node| &*node.name == name) {
            return Err(GraphError::DuplicateNode(name.to_owned()));
        }
        let release = release.into();
        let (arrivals, index) = (self.stage.arrivals(), self.seats.len());
        let mut wiring = Wiring::new(&self.control.topics, arrivals, index);
        let node = Box::new(build(&mut wiring));
        let Wiring {
            endpoints,
            wired,
            subscriptions,
            ..
        } = wiring;
        let ends = Ends {
            subscriptions,
            meters: wired.meters.clone(),
            push_age: wired.push_age.clone(),
            outbox: wired.outbox.clone(),
        };
        let triggers = triggers::check(name, release, &endpoints, &self.control)?;
        self.control.connect(endpoints)?;
        let Wired {
            meters, push_age, ..
        } = wired;
        let (mut entry, meters) = NodeEntry::new(name, priority, release.hz(), meters, push_age);
        let mut task = Task::new(&entry, release, self.now(), wired.intakes);
        task.seed = self.control.seed;
        entry.triggers = triggers.into();
        if let Release::On(matching) = release {
            entry.matching = matching;
        }
        self.control.nodes.push(entry.clone());
        self.stage.add(task);
        let seat = Seat::new(entry, meters, node, wired.outbox, wired.fixed);
        self.seats.push(seat);
        Ok(ends)
    }

    /// Copies every message of `topic` from now on; see [`TapHandle::topic`].
    pub fn tap<T: Payload>(&self, topic: &Topic<T>, capacity: usize) -> Tap<TapMessage<T>> {
        self.tap_handle().topic(topic, capacity)
    }

    /// Taps topics and nodes, even while the graph is running. Covers the nodes that the
    /// graph has at this moment.
    pub fn tap_handle(&self) -> TapHandle {
        TapHandle {
            backpressure: self.control.backpressure.clone(),
            nodes: self.seats.iter().map(|seat| seat.taps.clone()).collect(),
        }
    }

    /// Reads the graph from any thread while it runs. Covers the nodes and topics that
    /// the graph has at this moment.
    pub fn observer(&self) -> Observer {
        Observer {
            state: self.control.state.clone(),
            nodes: self.control.nodes.clone(),
            topics: self
                .control
                .topics
                .iter()
                .map(|t| t.entry.clone())
                .collect(),
        }
    }

    /// Current run time.
    pub fn now(&self) -> Time {
        self.control.now()
    }

    /// Sets the clock that runs the graph from now on. Observers show it, and full taps
    /// block in virtual time only.
    pub fn set_clock(&mut self, clock: ClockKind) {
        self.control.update(|status| status.clock = clock);
        self.control.backpressure.set(clock == ClockKind::Virtual);
    }

    /// Sets the speed of the virtual clock.
    pub fn set_speed(&mut self, speed: Speed) {
        self.control.update(|status| status.speed = speed);
    }

    /// Sets the seed of all random durations.
    pub fn set_seed(&mut self, seed: u64) {
        self.control.seed = seed;
        let tasks = &mut self.stage.tasks;
        tasks.iter_mut().for_each(|task| task.seed = seed);
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
                match &self.seats[index] {
                    seat if seat.entry.remote => Ok(()),
                    seat => node_knobs::check(&self.stage.tasks[index], seat, knob),
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
            false => self.obey(knob.target(), &knob.clone().into(), now),
        }
    }

    /// Lets `node` carry out its command.
    pub(crate) fn obey(
        &mut self,
        node: &str,
        command: &Command,
        at: Time,
    ) -> Result<String, String> {
        let index = self.control.node_index(node)?;
        match &mut self.seats[index] {
            // A setting for the process in which it runs.
            seat if seat.entry.remote => Ok(String::new()),
            seat => node_knobs::obey(&mut self.stage.tasks[index], seat, command, at),
        }
    }
}

impl ControlPlane {
    pub(crate) fn now(&self) -> Time {
        Time::from_nanos(self.state.now.load(Ordering::Relaxed))
    }

    pub(crate) fn set_now(&self, now: Time) {
        self.state.now.store(now.as_nanos(), Ordering::Relaxed);
    }

    pub(crate) fn log(&self) -> &EventLog {
        &self.state.log
    }

    pub(crate) fn update(&mut self, change: impl FnOnce(&mut Status)) {
        change(&mut self.status);
        *lock(&self.state.status) = self.status;
    }

    pub(crate) fn node_index(&self, name: &str) -> Result<usize, String> {
        let known = self.nodes.iter().position(|node| &*node.name == name);
        let names = self.nodes.iter().map(|node| &*node.name);
        known.ok_or_else(|| nothing_called("node", name, names))
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
        topic.turn(knob, self.seed, now)
    }

    /// Checks that the topic has this knob.
    fn check(&self, knob: &Knob) -> Result<(), String> {
        let topic = self.topic(knob.target())?;
        let read = !topic.entry.subscriptions.is_empty();
        if read || knob.kind() == KnobKind::Depth {
            return Ok(());
        }
        let names = self
            .topics
            .iter()
            .filter(|t| !t.entry.subscriptions.is_empty());
        let names: Vec<&str> = names.map(|t| &*t.entry.name).collect();
        let name = &topic.entry.name;
        Err(match &names[..] {
            [] => format!("{name} has no reader, and no topic has one: let a node read it first"),
            names => format!("{name} has no reader: expected one of {}", names.join(", ")),
        })
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
        let known = self.topics.iter().find(|t| &*t.entry.name == name);
        let names = self.topics.iter().map(|t| &*t.entry.name);
        known.ok_or_else(|| nothing_called("topic", name, names))
    }

    /// Adds the edges of a node, and the topics that are new with them.
    fn connect(&mut self, endpoints: Vec<Endpoint>) -> Result<(), GraphError> {
        let mut names: Vec<Arc<str>> = Vec::new();
        for topic in endpoints
            .iter()
            .filter_map(|endpoint| endpoint.new_topic.as_ref())
        {
            let taken = self.topics.iter().map(|t| &t.entry.name).chain(&names);
            if taken.into_iter().any(|name| *name == topic.entry.name) {
                return Err(GraphError::DuplicateTopic(topic.entry.name.to_string()));
            }
            names.push(topic.entry.name.clone());
        }
        for endpoint in endpoints {
            self.topics.extend(endpoint.new_topic);
            let entry = &mut self.topics[endpoint.topic].entry;
            match endpoint.kind {
                EndpointKind::Publisher(node) => entry.publishers.push(node),
                EndpointKind::Subscription(subscription) => entry.subscriptions.push(subscription),
            }
        }
        Ok(())
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
/// let topics = graph.observer().topology().topics;
/// assert_eq!((topics[0].name.as_str(), &topics[0].readers[..]), ("/range", &[0][..]));
/// assert_eq!((topics[1].name.as_str(), &topics[1].publishers[..]), ("/alarm", &[0][..]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Wiring<'g> {
    known: &'g [WiredTopic],
    node: usize,
    endpoints: Vec<Endpoint>,
    wired: Wired,
    subscriptions: Vec<(Arc<TopicCounters>, SubscriptionEntry)>,
    /// What the node took that is built once more.
    former: Option<Ends>,
    arrivals: Option<&'g Arc<Arrivals>>,
}

/// What a node took when it was built.
#[derive(Clone)]
struct Ends {
    /// Each with the counters of its topic.
    subscriptions: Vec<(Arc<TopicCounters>, SubscriptionEntry)>,
    meters: Vec<(String, Meter)>,
    push_age: Option<PushAge>,
    outbox: Arc<Outbox>,
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

enum EndpointKind {
    Publisher(usize),
    Subscription(SubscriptionEntry),
}

impl<'g> Wiring<'g> {
    fn new(known: &'g [WiredTopic], arrivals: &'g Arc<Arrivals>, node: usize) -> Self {
        Self {
            arrivals: Some(arrivals),
            ..Self::empty(known, node)
        }
    }

    fn empty(known: &'g [WiredTopic], node: usize) -> Self {
        Self {
            known,
            node,
            endpoints: Vec::new(),
            wired: Wired::default(),
            subscriptions: Vec::new(),
            former: None,
            arrivals: None,
        }
    }

    /// Hands out the `former` ends of a node that is built once more.
    fn again(former: Ends) -> Self {
        Self {
            former: Some(former),
            ..Self::empty(&[], 0)
        }
    }

    /// Connects the node as a publisher of `topic`.
    pub fn publisher<T: Payload>(&mut self, topic: &Topic<T>) -> Publisher<T> {
        if let Some(former) = &self.former {
            return topic.publisher_through(&former.outbox);
        }
        let kind = EndpointKind::Publisher(self.node);
        self.add_endpoint(topic, kind);
        topic.publisher_through(&self.wired.outbox)
    }

    /// Connects the node as a reader of `topic`.
    pub fn subscription<T: Payload>(&mut self, topic: &Topic<T>) -> Subscription<T> {
        if let Some(SubscriptionEntry { mark, ages, .. }) = self.former_subscription(topic) {
            return topic.subscribe_again(mark, ages);
        }
        let subscription = topic.subscribe();
        self.subscribe(topic, &subscription);
        subscription
    }

    /// Connects the node as a reader of `topic`, whose messages trigger it; see
    /// [`Release::On`]. Each message counts once: in a tick the subscription reads the one
    /// that the tick is for, whatever the read order of the topic.
    ///
    /// ```
    /// use ratelab::{Depth, GO_ON, Graph, Match, Topic};
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
        let input = self.wired.intakes.len();
        let (subscription, intake) = topic.trigger(self.node, input, arrivals);
        self.wired.intakes.push(intake);
        self.subscribe(topic, &subscription);
        if let Some(endpoint) = self.endpoints.last_mut() {
            endpoint.triggers = true;
        }
        subscription
    }

    fn subscribe<T: Payload>(&mut self, topic: &Topic<T>, subscription: &Subscription<T>) {
        let entry = SubscriptionEntry {
            node: self.node,
            mark: subscription.mark(),
            ages: subscription.ages(),
        };
        let kept = (topic.counters(), entry.clone());
        self.subscriptions.push(kept);
        self.add_endpoint(topic, EndpointKind::Subscription(entry));
    }

    /// Adds a duration that the node measures, shown to observers under `name`.
    pub fn meter(&mut self, name: &str) -> MeterRecorder {
        let mut former = self.former.iter().flat_map(|former| &former.meters);
        if let Some((_, meter)) = former.find(|(known, _)| known == name) {
            return meter.recorder();
        }
        let (recorder, meter) = Meter::new();
        self.wired.meters.push((name.to_owned(), meter));
        recorder
    }

    /// Declares that the node acts on the world outside of the graph; it records the age
    /// of the sensing behind each push.
    pub fn push_age(&mut self) -> PushAge {
        if let Some(age) = self.former.as_ref().and_then(|f| f.push_age.as_ref()) {
            return age.clone();
        }
        self.wired.push_age.get_or_insert_default().clone()
    }

    /// Removes the knobs of these `kinds` from the node; the refusal shows the `reason`.
    pub fn fix(&mut self, kinds: &'static [KnobKind], reason: &'static str) {
        self.wired.fixed = Fixed { kinds, reason };
    }

    /// The next end by which the former node read from `topic`.
    fn former_subscription<T: Payload>(&mut self, topic: &Topic<T>) -> Option<SubscriptionEntry> {
        let subscriptions = &mut self.former.as_mut()?.subscriptions;
        let is_of = |(counters, _): &(Arc<TopicCounters>, SubscriptionEntry)| {
            Arc::ptr_eq(counters, &topic.counters())
        };
        let place = subscriptions.iter().position(is_of)?;
        Some(subscriptions.remove(place).1)
    }

    fn add_endpoint<T: Payload>(&mut self, topic: &Topic<T>, kind: EndpointKind) {
        let counters = topic.counters();
        let fresh = self
            .endpoints
            .iter()
            .filter_map(|endpoint| endpoint.new_topic.as_ref());
        let mut topics = self.known.iter().chain(fresh);
        let position = topics.position(|t| Arc::ptr_eq(&t.entry.counters, &counters));
        let count = self.known.len()
            + self
                .endpoints
                .iter()
                .filter(|e| e.new_topic.is_some())
                .count();
        let new_topic = position.is_none().then(|| WiredTopic {
            entry: TopicEntry {
                name: topic.name().into(),
                counters,
                publishers: Vec::new(),
                subscriptions: Vec::new(),
            },
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
