//! Nodes wired to topics.
//!
//! A graph is built by giving nodes the ends of topics, and thereby learns its own
//! structure: publishers and readers of each topic, and the rate of each node.

mod control;
mod executors;
mod new_node;
mod topology;
mod wiring;

use std::convert::Infallible;

use thiserror::Error;

pub(crate) use self::control::ControlPlane;
use self::{control::WiredTopic, new_node::NewNode};
pub use self::{
    executors::RealClockRefusal,
    topology::{NodeTopology, TopicTopology, Topology},
    wiring::Wiring,
};
use crate::{
    arrival::{Arrival, Arrivals},
    control::{
        command::{ClockKind, KnobRefusal, Speed},
        knob::Knob,
        state::{RunState, RunWriter, Status},
    },
    node::{Node, NodeSlot, Rebuild, Tick},
    qos::Depth,
    rate::Rate,
    record::{RecordSender, Sink},
    scheduling::{Schedule, Task, TaskSet},
    settings::release::Release,
    sync::{Arc, Mutex, get_mut, lock},
    time::{HzError, Time},
    topic::{Payload, Topic},
    trigger::Trigger,
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
    /// A topic that another graph has, with its old messages.
    #[error("the topic {0:?} is in another graph: make one for each graph")]
    TopicOfAnotherGraph(String),
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
    #[error("node {0:?} is already in an executor: list it once")]
    SecondExecutor(String),
    /// A number that is not a rate.
    #[error(transparent)]
    Rate(#[from] HzError),
    /// A node that messages trigger is to have a rule that needs a period.
    #[error("messages trigger {node:?}, so it has no period for {executor}: {remedy}")]
    NoPeriod {
        /// The node.
        node: String,
        /// The executor.
        executor: String,
        /// What to give the node.
        remedy: &'static str,
    },
}

impl From<Infallible> for GraphError {
    fn from(never: Infallible) -> Self {
        match never {}
    }
}

/// Nodes, the topics between them, and the progress of their run.
///
/// A graph of three nodes or of a thousand is built by the same calls. It holds all state
/// of a run, so it can be handed over from one [`Clock`](crate::Clock) to another and
/// continues there.
///
/// ```
/// use ratelab::{Depth, Graph, Hz, Tick, Topic};
///
/// let mut graph = Graph::new();
/// let ticks = Topic::new("/ticks", Depth::ONE);
///
/// graph.node("metronome", Hz::new(2.0)?, 0, |wiring| {
///     let output = wiring.publisher(&ticks);
///     move |tick: &mut Tick| tick.publish(&output, "tick")
/// })?;
/// assert_eq!(graph.topology().topics[0].publishers, [0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Graph {
    /// The nodes, by their indices.
    pub(crate) slots: Vec<Mutex<NodeSlot>>,
    pub(crate) schedule: Schedule,
    pub(crate) control: ControlPlane,
    /// What is published for nodes that messages trigger.
    pub(crate) arrivals: Arc<Arrivals>,
    /// [`Clock::cores`](crate::Clock::cores) of the real clock; none until it tells.
    pub(crate) cores: Option<usize>,
}

impl Default for Graph {
    fn default() -> Self {
        Self::new()
    }
}

impl Graph {
    /// Creates an empty graph at run time zero, with seed 0.
    pub fn new() -> Self {
        Self::with_seed(0)
    }

    /// Creates an empty graph whose random durations follow `seed`.
    pub fn with_seed(seed: u64) -> Self {
        let status = Status {
            clock: ClockKind::Virtual,
            paused: false,
            speed: Speed::Unlimited,
        };
        Self {
            slots: Vec::new(),
            schedule: Schedule::new(ClockKind::Virtual, Vec::new()),
            control: ControlPlane {
                state: RunWriter::new(status),
                status,
                nodes: Vec::new(),
                remote: Vec::new(),
                topics: Vec::new(),
                records: RecordSender::default(),
                seed,
            },
            arrivals: Arc::default(),
            cores: None,
        }
    }

    /// Returns a topic for nodes of this graph, which keeps its newest message.
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
    pub fn node<N: Node + 'static, R: TryInto<Release, Error: Into<GraphError>>>(
        &mut self,
        name: &str,
        release: R,
        priority: u32,
        build: impl FnOnce(&mut Wiring<'_>) -> N,
    ) -> Result<(), GraphError> {
        self.add(&NewNode::here(name, release, priority)?, build)
    }

    /// Adds a node as [`Graph::node`] does; a restart calls `build` once more, and sends the
    /// new node its `message`.
    ///
    /// # Errors
    /// As of [`Graph::node`].
    pub fn restartable_node<N: Node + 'static, R: TryInto<Release, Error: Into<GraphError>>>(
        &mut self,
        name: &str,
        release: R,
        priority: u32,
        mut build: impl FnMut(&mut Wiring<'_>) -> N + Send + 'static,
        message: Option<&str>,
    ) -> Result<(), GraphError> {
        self.add(&NewNode::here(name, release, priority)?, &mut build)?;
        if let Some(slot) = self.slots.last_mut() {
            get_mut(slot).again = Some(Rebuild {
                build: Box::new(move |ends| Box::new(build(&mut Wiring::again(ends)))),
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
    pub fn remote_node<N: Node + 'static, R: TryInto<Release, Error: Into<GraphError>>>(
        &mut self,
        name: &str,
        release: R,
        priority: u32,
        build: impl FnOnce(&mut Wiring<'_>) -> N,
    ) -> Result<(), GraphError> {
        let wire = |wiring: &mut Wiring<'_>| {
            // Its ends of topics are of no use here, and go at once.
            drop(build(wiring));
            |_: &mut Tick| {}
        };
        let new = NewNode::here(name, release, priority)?;
        let remote = true;
        self.add(&NewNode { remote, ..new }, wire)
    }

    /// Adds a node.
    fn add<N: Node + 'static>(
        &mut self,
        new: &NewNode<'_>,
        build: impl FnOnce(&mut Wiring<'_>) -> N,
    ) -> Result<(), GraphError> {
        if self.control.nodes.iter().any(|node| node.name == new.name) {
            return Err(GraphError::DuplicateNode(new.name.to_owned()));
        }
        let index = self.slots.len();
        let records = self.control.records.for_index(index);
        let mut wiring = Wiring::new(&self.control.topics, &self.arrivals, records);
        let node = Box::new(build(&mut wiring));
        let Wiring {
            new: topics,
            publishes,
            reads,
            triggers,
            intakes,
            fixed,
            ends,
            ..
        } = wiring;
        new_node::check(&self.control, new, (&triggers, &publishes))?;
        self.control.connect(index, topics, (&publishes, &reads))?;
        let topology = new.topology(triggers, ends.meters.clone());
        self.control.nodes.push(topology);
        self.control.remote.push(new.remote);
        let name = Arc::<str>::from(new.name);
        let member = new.member(name.clone(), index, intakes.len(), &ends);
        let trigger = match new.release {
            Release::AtRate(_) => None,
            Release::On(matching) => Some(Trigger::new(matching, intakes)),
        };
        let rate = Rate::new(new.release.hz(), self.now());
        let task = Task::new(name, self.control.seed, rate, trigger);
        self.schedule.add(TaskSet::new(task, member));
        let slot = NodeSlot::new(node, ends, fixed);
        self.slots.push(Mutex::new(slot));
        Ok(())
    }

    /// Returns the sink of the graph's records; if it has none, what `make` returns from now on. A
    /// graph has one sink for all of its life.
    pub fn sink_or(&self, make: impl FnOnce() -> Arc<dyn Sink>) -> Arc<dyn Sink> {
        self.control.records.sink_or(make)
    }

    /// Returns the state of the run, for reading it from any thread.
    pub fn state(&self) -> Arc<RunState> {
        self.control.state.state()
    }

    /// Returns the writing end of that state: for clocks, and for what hears of nodes in other
    /// processes.
    pub fn run_writer(&self) -> RunWriter {
        self.control.state.clone()
    }

    /// Returns the nodes, topics and connections, with their rates and depths in force.
    pub fn topology(&self) -> Topology {
        let nodes = self.control.nodes.iter();
        let topics = self.control.topics.iter();
        let mut topology = Topology {
            nodes: nodes.cloned().collect(),
            topics: topics.map(WiredTopic::topology).collect(),
        };
        let rates = topology.rates(|node| self.schedule.state(node, self.now()).hz);
        topology
            .nodes
            .iter_mut()
            .zip(rates)
            .for_each(|(node, hz)| node.hz = hz);
        topology
    }

    /// Returns the number of its nodes.
    pub fn node_count(&self) -> usize {
        self.slots.len()
    }

    /// Returns whether this process runs the node with this index.
    pub fn is_here(&self, node: usize) -> bool {
        self.control.remote.get(node) == Some(&false)
    }

    /// Returns whether the node with this index crashed without a restart since.
    pub fn is_crashed(&self, node: usize) -> bool {
        node < self.slots.len() && self.schedule.state(node, self.now()).crashed
    }

    /// Returns the messages in flight that arrive after `now`, for nodes that have run elsewhere:
    /// what was delivered waits in the queues.
    pub(crate) fn in_flight(&self, now: Time) -> Vec<Arrival> {
        self.arrivals.take();
        self.control.arrivals_after(now)
    }

    /// Current run time.
    pub fn now(&self) -> Time {
        self.control.state.now()
    }

    /// Sets the clock that runs the graph from now on. Virtual time waits for
    /// observers.
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

    /// Checks that the knob exists and that everything its value needs is loaded.
    ///
    /// # Errors
    /// The reason, with the available alternatives.
    pub fn check(&self, knob: &Knob) -> Result<(), KnobRefusal> {
        if knob.kind().is_of_topic() {
            return self.control.check(knob);
        }
        let index = self.control.node_index(knob.target())?;
        if self.is_here(index) {
            self.schedule.check(index, &lock(&self.slots[index]), knob)
        } else {
            Ok(())
        }
    }

    /// Sets a knob between two runs, or before the first; returns the one that was in force, unless the
    /// node runs in another process. For `lose` and `hang`, which cannot be taken back, returns what the
    /// log shows.
    ///
    /// # Errors
    /// The reason and a remedy; nothing is changed then, but for a node that refuses to be restarted:
    /// it stays crashed.
    pub fn set(&mut self, knob: &Knob) -> Result<Option<Knob>, KnobRefusal> {
        let now = self.now();
        if knob.kind().is_of_topic() {
            self.control.set(knob, now).map(Some)
        } else {
            self.set_node(knob, now)
        }
    }

    /// Sets a knob of a node at run time `at`; returns the one that was in force.
    ///
    /// # Errors
    /// The reason and a remedy.
    pub(crate) fn set_node(&mut self, knob: &Knob, at: Time) -> Result<Option<Knob>, KnobRefusal> {
        let index = self.control.node_index(knob.target())?;
        if !self.is_here(index) {
            // A setting for the process in which it runs.
            return Ok(None);
        }
        let slot = get_mut(&mut self.slots[index]);
        self.schedule.set(index, slot, knob, at).map(Some)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::RunError;

    fn talker(graph: &mut Graph, topic: &Topic<u8>) -> Result<(), GraphError> {
        graph.node("talker", 10.0, 0, |wiring| {
            let topic = wiring.publisher(topic);
            move |tick: &mut Tick| tick.publish(&topic, 1)
        })
    }

    #[test]
    fn a_topic_is_in_one_graph() {
        let topic = Topic::new("/a", Depth::ONE);
        talker(&mut Graph::new(), &topic).expect("a graph");
        let refused = talker(&mut Graph::new(), &topic).map_err(|why| why.to_string());
        let why = "the topic \"/a\" is in another graph: make one for each graph";
        assert_eq!(refused, Err(why.to_owned()));
    }

    #[test]
    fn a_run_goes_on_to_a_later_end_and_never_back() {
        let mut graph = Graph::new();
        let topic = graph.topic("/a");
        talker(&mut graph, &topic).expect("a graph");
        graph.run_virtual(1.0).expect("a second");
        graph.run_virtual(2.0).expect("another one");
        let past = graph.run_virtual(0.5);
        assert!(matches!(past, Err(RunError::Past { .. })), "{past:?}");
        assert_eq!(graph.now(), Time::from_nanos(2_000_000_000));
    }
}
