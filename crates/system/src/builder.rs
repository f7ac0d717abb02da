//! Builds the graph of a system.

use std::{collections::BTreeMap, sync::Arc};

use ratelab::{
    Callback, Depth, Executor, Graph, Hz, IntoTickResult, Knob, KnobKind, KnobRefusal, Node,
    Payload, Release, Tick, Time, TimedKnob, Topic, Wiring,
};
use ratelab_metrics::{Fields, NamedTopic, RecordedTopic};

use crate::{BuildError, ChainTracker, Setup, SharedWorld, World, WorldKind};

/// Name of the node of a plant that moves by itself.
pub const WORLD: &str = "world";

/// What a program that stands behind a node answered when a run was recorded, by the start of the
/// tick: the message that the node published, or why it crashed.
pub type RecordedAnswers = BTreeMap<Time, Result<Vec<f64>, String>>;

/// The recorded answers of a run, by the names of nodes.
pub type AnswersOfNodes = BTreeMap<String, Arc<RecordedAnswers>>;

/// The inputs of a graph that is built for one run.
#[derive(Clone, Debug)]
pub struct BuildInputs<'a> {
    /// Seed of the run, for all random numbers.
    pub seed: u64,
    /// The knobs set before the run begins.
    pub setup: &'a Setup,
    /// The kind of world.
    pub world: WorldKind,
    /// Changes of knobs during the run.
    pub timed: &'a [TimedKnob],
    /// Knobs that a recorded run was turned by, if the run is executed again.
    pub taken: &'a [TimedKnob],
    /// What programs answered then, so that nobody asks them again.
    pub answers: AnswersOfNodes,
    /// The nodes that run in this process; `None` for all.
    pub here: Option<&'a [String]>,
}

/// A graph that is ready to run, and what a run needs beside it.
pub struct BuiltGraph {
    /// The graph.
    pub graph: Graph,
    /// Its recorded topics, in the order of their creation.
    pub topics: RecordedTopics,
    /// Follows the data of its chains, in a graph with chains.
    pub tracker: Option<Arc<ChainTracker>>,
}

/// Collects the nodes and topics of a graph, with their settings.
pub struct Builder<'a> {
    seed: u64,
    setup: &'a Setup,
    world: WorldKind,
    /// Whether the system has asked for the kind of world.
    knows_worlds: bool,
    /// Knobs that a recorded run was turned by, if it is run again.
    pub(crate) taken: &'a [TimedKnob],
    /// What programs answered then, if they are not to be asked again.
    pub(crate) answers: AnswersOfNodes,
    pub(crate) graph: Graph,
    pub(crate) recorded: RecordedTopics,
    /// The messages and parameters that nodes were built with.
    answered: Vec<(KnobKind, String)>,
    /// Nodes to insert before the readers of topics.
    relays: Vec<ForwardingNode>,
    /// The topics that were offered for that.
    pub(crate) offered: Vec<String>,
    /// The nodes that run in this process; `None` for all.
    pub(crate) here: Option<&'a [String]>,
    /// Whether nodes may be in the graph that the builder does not know.
    is_open: bool,
    /// What follows the data of its chains.
    pub(crate) tracker: Option<Arc<ChainTracker>>,
}

/// A node between a topic and its reader, which forwards the newest message with the time
/// of the sensing behind it.
#[derive(Clone, Debug)]
pub(crate) struct ForwardingNode {
    /// Its name.
    pub(crate) node: String,
    /// When it ticks.
    pub(crate) release: Release,
    /// Name of the topic that it reads.
    pub(crate) from: String,
    /// Name of the topic that it publishes.
    pub(crate) to: String,
}

/// The recorded topics, in the order of their creation.
pub type RecordedTopics = Vec<Arc<dyn RecordedTopic>>;

impl<'a> Builder<'a> {
    /// Creates an empty graph for a run with `seed`.
    pub(crate) fn new(seed: u64, setup: &'a Setup, world: WorldKind) -> Self {
        Self {
            seed,
            setup,
            world,
            knows_worlds: false,
            taken: &[],
            answers: BTreeMap::new(),
            graph: Graph::with_seed(seed),
            recorded: Vec::new(),
            answered: Vec::new(),
            relays: Vec::new(),
            offered: Vec::new(),
            here: None,
            is_open: false,
            tracker: None,
        }
    }

    /// Returns the graph itself, for nodes and topics that are added as in the library. The rates
    /// and depths that are set come into force when it is built; such a graph runs in one process.
    pub fn graph(&mut self) -> &mut Graph {
        self.is_open = true;
        &mut self.graph
    }

    /// Records a topic of the [graph](Self::graph).
    pub fn record<T: Fields + Payload>(&mut self, topic: &Topic<T>) {
        self.record_as(topic.clone(), T::FIELDS.iter().copied());
    }

    /// Records a topic with a name for each number of a message.
    pub fn record_as<T: Fields + Payload>(
        &mut self,
        topic: Topic<T>,
        fields: impl IntoIterator<Item: Into<String>>,
    ) {
        let fields = fields.into_iter().map(Into::into).collect();
        self.recorded.push(Arc::new(NamedTopic { topic, fields }));
    }

    /// Seed of the run, for all random numbers.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// Returns what the program behind `node` answered when this run was recorded; `None` if it is
    /// to be asked.
    pub fn answers(&self, node: &str) -> Option<Arc<RecordedAnswers>> {
        self.answers.get(node).cloned()
    }

    /// Returns the knobs set before the run begins.
    pub fn setup(&self) -> &'a Setup {
        self.setup
    }

    /// Returns the kind of world. A system that never calls this supports the course's world
    /// only.
    pub fn world(&mut self) -> WorldKind {
        self.knows_worlds = true;
        self.world
    }

    fn is_here(&self, node: &str) -> bool {
        let is_named = |names: &[String]| names.iter().any(|name| name == node);
        self.here.is_none_or(is_named)
    }

    /// Returns whether this is a recorded run, executed again, that was turned by a knob of this
    /// `kind` on `target`: recordings may hold knobs that new runs do not have.
    pub fn was_turned(&self, kind: KnobKind, target: &str) -> bool {
        let mut knobs = self.taken.iter().map(|timed| &timed.knob);
        knobs.any(|knob| knob.kind() == kind && knob.target() == target)
    }

    /// Adds a plant that moves by itself, as a node called [`WORLD`]. At rate `hz`,
    /// before all other nodes, it advances the plant to the current time and calls
    /// `look`. Must be added before all other nodes.
    ///
    /// # Errors
    /// [`BuildError`] for an invalid `hz` or a name that is taken.
    pub fn own_world<W: World, F, R: IntoTickResult + 'static>(
        &mut self,
        world: W,
        hz: f64,
        look: impl FnOnce(&mut Wiring<'_>) -> F,
    ) -> Result<SharedWorld<W>, BuildError>
    where
        F: FnMut(&W, &mut Tick) -> R + Send + 'static,
    {
        let world = SharedWorld::new(world);
        let shared = world.clone();
        let build = |wiring: &mut Wiring<'_>| {
            wiring.fix(
                KnobKind::ALL
                    .into_iter()
                    .filter(|kind| kind.is_of_schedule()),
                "the world moves by itself: choose a node of the robot",
            );
            let mut look = look(wiring);
            move |tick: &mut Tick| look(&world.at(tick.now()), tick)
        };
        self.single_node(WORLD, Hz::new(hz)?.into(), 0, build)?;
        Ok(shared)
    }

    /// Creates a recorded topic, with a default depth of one.
    pub fn topic<T: Fields + Payload>(&mut self, name: &str) -> Topic<T> {
        let topic = self.internal_topic(name);
        self.record(&topic);
        topic
    }

    /// Returns the recorded topic called `name`, if it was created before.
    pub(crate) fn recorded(&self, name: &str) -> Option<Arc<dyn RecordedTopic>> {
        self.recorded
            .iter()
            .find(|topic| topic.name() == name)
            .cloned()
    }

    /// Inserts `relays` where the system offers it; see [`Builder::through`].
    pub(crate) fn insert(&mut self, relays: Vec<ForwardingNode>) {
        self.relays = relays;
    }

    /// Returns the topic that a reader of `topic` is to read: the topic itself, or the last one
    /// behind the nodes that are inserted there, such as a camera and a detector. `priority` is
    /// that of the publisher of `topic`.
    ///
    /// # Errors
    /// As of [`Builder::node`].
    pub fn through<T: Fields + Payload>(
        &mut self,
        topic: &Topic<T>,
        priority: u32,
    ) -> Result<Topic<T>, BuildError> {
        self.offered.push(topic.name().to_owned());
        let mut last = topic.clone();
        let relays = self.relays.clone().into_iter();
        for relay in relays {
            if relay.from != last.name() {
                continue;
            }
            let (input, output) = (last, self.topic::<T>(&relay.to));
            last = output.clone();
            let triggered = matches!(relay.release, Release::On(_));
            self.released_node(&relay.node, relay.release, priority, move |wiring| {
                let mut input = if triggered {
                    wiring.trigger(&input)
                } else {
                    wiring.subscription(&input)
                };
                let output = wiring.publisher(&output);
                move |tick: &mut Tick| {
                    if let Some(message) = tick.read(&mut input) {
                        tick.publish(&output, message.data);
                    }
                }
            })?;
        }
        Ok(last)
    }

    /// Creates a topic without a recording: its payload need not be
    /// [`Fields`](ratelab_metrics::Fields).
    pub fn internal_topic<T: Payload>(&mut self, name: &str) -> Topic<T> {
        Topic::new(name, self.setup.depth(name).unwrap_or(Depth::ONE))
    }

    /// Returns the initial release of `node`: at the rate that is set, or else as in `usual`.
    fn release(&self, node: &str, usual: Release) -> Release {
        match (usual, self.setup.rate(node)) {
            (Release::AtRate(_), Some(hz)) => hz.into(),
            (usual, _) => usual,
        }
    }

    /// Returns the configured message for `node`, for systems that use it to build the node.
    /// Other nodes receive theirs before the run begins.
    pub fn message(&mut self, node: &str) -> Option<&'a str> {
        let message = self.setup.message(node)?;
        self.answered.push((KnobKind::Send, node.to_owned()));
        Some(message)
    }

    /// Returns the configured parameter `name` of `node`, for systems that use it to build the
    /// graph. Nodes receive their other parameters before the run begins.
    pub fn parameter(&mut self, node: &str, name: &str) -> Option<&'a str> {
        let value = self.setup.parameter(node, name)?;
        let subject = format!("{node} {name}");
        self.answered.push((KnobKind::Parameter, subject));
        Some(value)
    }

    fn is_answered(&self, kind: KnobKind, subject: &str) -> bool {
        self.answered
            .iter()
            .any(|(of, known)| *of == kind && known == subject)
    }

    /// Adds a node that ticks at `hz` unless set otherwise; see [`Graph::node`]. A
    /// restart builds it once more, and sends it the message that is set for it.
    ///
    /// # Errors
    /// [`BuildError`] for an invalid `hz`, or if the name of the node or of one of its
    /// topics is taken.
    pub fn node<N: Node + 'static>(
        &mut self,
        name: &str,
        hz: f64,
        priority: u32,
        build: impl FnMut(&mut Wiring<'_>) -> N + Send + 'static,
    ) -> Result<(), BuildError> {
        self.released_node(name, Hz::new(hz)?.into(), priority, build)
    }

    /// Adds a node that ticks at a rate, unless set otherwise, or on messages; see [`Release`].
    ///
    /// # Errors
    /// [`BuildError`] as of [`Builder::node`], and if nodes would trigger each other in a
    /// circle.
    pub fn released_node<N: Node + 'static>(
        &mut self,
        name: &str,
        release: Release,
        priority: u32,
        build: impl FnMut(&mut Wiring<'_>) -> N + Send + 'static,
    ) -> Result<(), BuildError> {
        let release = self.release(name, release);
        if !self.is_here(name) {
            return Ok(self.graph.remote_node(name, release, priority, build)?);
        }
        let answered = self.is_answered(KnobKind::Send, name);
        let message = self.setup.message(name).filter(|_| !answered);
        let graph = &mut self.graph;
        Ok(graph.restartable_node(name, release, priority, build, message)?)
    }

    /// Runs these nodes by an executor; see [`Graph::executor`].
    ///
    /// # Errors
    /// [`BuildError`] if the executor cannot have one of them.
    pub fn executor(
        &mut self,
        executor: Executor,
        callbacks: impl IntoIterator<Item = Callback>,
    ) -> Result<(), BuildError> {
        Ok(self.graph.executor(executor, callbacks)?)
    }

    /// Adds a node that holds what there is only once. A restart is up to [`Node::restart`].
    ///
    /// # Errors
    /// As of [`Builder::released_node`].
    pub fn single_node<N: Node + 'static>(
        &mut self,
        name: &str,
        release: Release,
        priority: u32,
        build: impl FnOnce(&mut Wiring<'_>) -> N,
    ) -> Result<(), BuildError> {
        let release = self.release(name, release);
        if self.is_here(name) {
            Ok(self.graph.node(name, release, priority, build)?)
        } else {
            Ok(self.graph.remote_node(name, release, priority, build)?)
        }
    }

    /// Sends the configured messages and returns the graph and its recorded topics.
    ///
    /// # Errors
    /// [`BuildError::Setting`] if a setting, or a later one in `timed`, has no
    /// counterpart in the graph, or if a node refuses its message.
    pub(crate) fn finish(mut self, timed: &[TimedKnob]) -> Result<BuiltGraph, BuildError> {
        if !self.knows_worlds && !self.world.is_course() {
            let why = "this system has no world of its own: leave the setting out";
            return Err(BuildError::Setting(why.to_owned()));
        }
        if self.is_open && self.here.is_some() {
            let why = "a graph of the library runs in one process: run it whole";
            return Err(BuildError::Setting(why.to_owned()));
        }
        for timed in timed {
            self.check(&timed.knob)?;
        }
        for knob in self.setup.iter() {
            self.set(knob)?;
        }
        Ok(BuiltGraph {
            graph: self.graph,
            topics: self.recorded,
            tracker: self.tracker,
        })
    }

    fn check(&self, knob: &Knob) -> Result<(), BuildError> {
        let known = self.graph.check(knob);
        known.map_err(|why| refused(knob, why))
    }

    /// Sets a knob that was not used while building the graph.
    fn set(&mut self, knob: &Knob) -> Result<(), BuildError> {
        if self.is_answered(knob.kind(), &knob.subject()) {
            return Ok(());
        }
        self.check(knob)?;
        if !self.is_open && matches!(knob.kind(), KnobKind::Rate | KnobKind::Depth) {
            return Ok(());
        }
        self.graph
            .set(knob)
            .map(drop)
            .map_err(|why| refused(knob, why))
    }
}

fn refused(knob: &Knob, why: KnobRefusal) -> BuildError {
    BuildError::Setting(format!("{knob}: {why}"))
}
