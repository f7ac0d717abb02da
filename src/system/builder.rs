//! From what a system says of its graph to the graph.

use std::{sync::Arc, time::Duration};

use super::{BuildError, Setup};
use crate::runtime::{
    Depth, Fields, Graph, Hz, Knob, Node, Payload, RecordedTopic, Time, TimedKnob, Topic, Wiring,
};

/// Takes the nodes and topics of a graph, and sets them up as asked.
pub struct Builder<'a> {
    seed: u64,
    setup: &'a Setup,
    think: Duration,
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
    pub(crate) fn new(seed: u64, setup: &'a Setup, think: Duration) -> Self {
        Self {
            seed,
            setup,
            think,
            graph: Graph::new(),
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

    /// How much longer a decision is to take, in wall time, for a system that has a
    /// node that decides.
    pub fn think(&self) -> Duration {
        self.think
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

    /// Adds a node that ticks at `hz` unless set otherwise; see [`Graph::node`].
    ///
    /// # Errors
    /// [`BuildError`] if `hz` is no rate, or the name of the node or of one of its
    /// topics is taken.
    pub fn node<N: Node + 'static>(
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
        for timed in timed {
            self.check(&timed.knob)?;
        }
        for knob in self.setup.iter() {
            self.check(knob)?;
            self.send(knob)?;
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

    fn send(&mut self, knob: &Knob) -> Result<(), BuildError> {
        let Knob::Send { node, .. } = knob else {
            return Ok(());
        };
        if self.answered.contains(node) {
            return Ok(());
        }
        let answer = self.graph.obey(node, &knob.clone().into(), Time::ZERO);
        answer.map_err(|why| BuildError::Setting(format!("{knob}: {why}")))?;
        Ok(())
    }
}
