//! From what a system says of its graph to the graph.

use std::sync::Arc;

use super::{BuildError, Setup, SharedWorld, World, WorldKind};
use crate::runtime::{
    Depth, Fields, Graph, Hz, Knob, KnobKind, Node, Payload, RecordedTopic, Tick, Time, TimedKnob,
    Topic, Wiring,
};

/// The name of the node that a plant is which moves by itself.
pub const WORLD: &str = "world";

/// Takes the nodes and topics of a graph, and sets them up as asked.
pub struct Builder<'a> {
    seed: u64,
    setup: &'a Setup,
    world: WorldKind,
    /// Whether the system looked at which world it is.
    knows_worlds: bool,
    graph: Graph,
    recorded: Vec<Arc<dyn RecordedTopic>>,
    /// Nodes that took the message that is set for them.
    answered: Vec<String>,
}

/// A graph as its system built it.
pub(crate) struct Built {
    pub(crate) graph: Graph,
    /// The topics that are recorded, in the order in which they were made.
    pub(crate) recorded: Vec<Arc<dyn RecordedTopic>>,
}

impl<'a> Builder<'a> {
    /// An empty graph for a run with `seed`.
    pub(crate) fn new(seed: u64, setup: &'a Setup, world: WorldKind) -> Self {
        let mut graph = Graph::new();
        graph.set_seed(seed);
        Self {
            seed,
            setup,
            world,
            knows_worlds: false,
            graph,
            recorded: Vec::new(),
            answered: Vec::new(),
        }
    }

    /// The seed of the run: whatever is drawn by chance follows from it.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// The knobs that are turned before the run begins.
    pub fn setup(&self) -> &'a Setup {
        self.setup
    }

    /// Whether the plant waits for the robot. A system that does not ask has one
    /// world, and refuses the other.
    pub fn world(&mut self) -> WorldKind {
        self.knows_worlds = true;
        self.world
    }

    /// Adds a plant that moves by itself, as a node called [`WORLD`]: at `hz`, before
    /// any other node ticks, the plant is brought to the time and `look` is taken
    /// at it. To be added before all other nodes.
    ///
    /// # Errors
    /// [`BuildError`] if `hz` is no rate, or a name is taken.
    pub fn own_world<W: World, F>(
        &mut self,
        world: W,
        hz: f64,
        look: impl FnOnce(&mut Wiring<'_>) -> F,
    ) -> Result<SharedWorld<W>, BuildError>
    where
        F: FnMut(&W, Time) -> Tick + Send + 'static,
    {
        let (world, hz) = (SharedWorld::new(world), Hz::new(hz)?);
        let shared = world.clone();
        self.graph.node(WORLD, hz, 0, |wiring| {
            const TIMES: &[KnobKind] = &[
                KnobKind::Rate,
                KnobKind::Takes,
                KnobKind::Offset,
                KnobKind::Wakes,
                KnobKind::Crash,
                KnobKind::Restart,
                KnobKind::Hang,
                KnobKind::Clock,
            ];
            wiring.fix(
                TIMES,
                "the world moves by itself: choose a node of the robot",
            );
            let mut look = look(wiring);
            move |now| look(&world.at(now), now)
        })?;
        Ok(shared)
    }

    /// A topic that is recorded, of depth one unless set otherwise.
    pub fn topic<T: Fields + Payload>(&mut self, name: &str) -> Topic<T> {
        let topic = self.internal_topic(name);
        self.recorded.push(Arc::new(topic.clone()));
        topic
    }

    /// A topic that is not recorded: its payload need not be
    /// [`Fields`](crate::runtime::Fields).
    pub fn internal_topic<T: Payload>(&mut self, name: &str) -> Topic<T> {
        Topic::new(name, self.setup.depth(name).unwrap_or(Depth::ONE))
    }

    /// The rate at which `node` is going to begin: as set, or else `hz`.
    ///
    /// # Errors
    /// [`BuildError`] if `hz` is no rate.
    pub fn rate(&self, node: &str, hz: f64) -> Result<Hz, BuildError> {
        match self.setup.rate(node) {
            Some(set) => Ok(set),
            None => Ok(Hz::new(hz)?),
        }
    }

    /// The message that is set for `node`, for a system that builds the node by
    /// it. Others get theirs as any message, before the run begins.
    pub fn message(&mut self, node: &str) -> Option<&'a str> {
        let message = self.setup.message(node)?;
        self.answered.push(node.to_owned());
        Some(message)
    }

    /// Adds a node that ticks at `hz` unless set otherwise; see [`Graph::node`]. A
    /// restart builds it once more, and sends it the message that is set for it.
    ///
    /// # Errors
    /// [`BuildError`] if `hz` is no rate, or the name of the node or of one of its
    /// topics is taken.
    pub fn node<N: Node + 'static>(
        &mut self,
        name: &str,
        hz: f64,
        priority: u32,
        build: impl FnMut(&mut Wiring<'_>) -> N + Send + 'static,
    ) -> Result<(), BuildError> {
        let hz = self.rate(name, hz)?;
        let answered = self.answered.iter().any(|known| known == name);
        let message = self.setup.message(name).filter(|_| !answered);
        let graph = &mut self.graph;
        Ok(graph.restartable_node(name, hz, priority, build, message)?)
    }

    /// The same for a node that holds what there is only once. A restart is up to
    /// [`Node::restart`].
    ///
    /// # Errors
    /// As of [`Builder::node`].
    pub fn single_node<N: Node + 'static>(
        &mut self,
        name: &str,
        hz: f64,
        priority: u32,
        build: impl FnOnce(&mut Wiring<'_>) -> N,
    ) -> Result<(), BuildError> {
        let hz = self.rate(name, hz)?;
        Ok(self.graph.node(name, hz, priority, build)?)
    }

    /// The graph, all messages sent.
    ///
    /// # Errors
    /// [`BuildError::Setting`] if something is set, or `timed` to be set, that the
    /// graph does not have, or a node refuses its message.
    pub(crate) fn finish(mut self, timed: &[TimedKnob]) -> Result<Built, BuildError> {
        if !self.knows_worlds && !self.world.is_course() {
            let why = "this system has no world of its own: leave the setting out";
            return Err(BuildError::Setting(why.to_owned()));
        }
        for timed in timed {
            self.check(&timed.knob)?;
        }
        for knob in self.setup.iter() {
            self.check(knob)?;
            self.turn(knob)?;
        }
        Ok(Built {
            graph: self.graph,
            recorded: self.recorded,
        })
    }

    fn check(&self, knob: &Knob) -> Result<(), BuildError> {
        let known = self.graph.check(knob);
        known.map_err(|why| BuildError::Setting(format!("{knob}: {why}")))
    }

    /// Turns a knob that the graph was not built by.
    fn turn(&mut self, knob: &Knob) -> Result<(), BuildError> {
        let node = knob.target();
        let answer = match knob.kind() {
            KnobKind::Rate | KnobKind::Depth => return Ok(()),
            KnobKind::Send if self.answered.iter().any(|known| known == node) => return Ok(()),
            kind if kind.is_of_topic() => self.graph.control.turn(knob, Time::ZERO),
            _ => self.graph.obey(node, &knob.clone().into(), Time::ZERO),
        };
        answer.map_err(|why| BuildError::Setting(format!("{knob}: {why}")))?;
        Ok(())
    }
}
