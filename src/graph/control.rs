//! What is left of a graph without its nodes: names, topics and the state of its run.

use super::{
    GraphError,
    topology::{NodeTopology, TopicTopology},
};
use crate::{
    arrival::Arrival,
    control::{
        command::KnobRefusal,
        knob::Knob,
        state::{RunWriter, Status},
    },
    record::RecordSender,
    settings::draw::Draw,
    sync::Arc,
    time::Time,
    topic::{AnyTopic, Payload, Topic},
};

/// The part of a graph that commands change and observers read: everything except the
/// nodes, which may be away on their threads.
pub(crate) struct ControlPlane {
    pub(crate) state: RunWriter,
    /// That of the state, which its only writer reads without a lock.
    pub(crate) status: Status,
    pub(super) nodes: Vec<NodeTopology>,
    /// Whether each of them runs in another process; known here while its task set is on threads.
    pub(super) remote: Vec<bool>,
    pub(super) topics: Vec<WiredTopic>,
    pub(super) records: RecordSender,
    /// The seed of every random draw.
    pub(super) seed: u64,
}

/// A topic with the indices of its nodes.
pub(super) struct WiredTopic {
    name: Arc<str>,
    /// Number of its bus, the same for each handle.
    pub(super) address: usize,
    pub(super) publishers: Vec<usize>,
    pub(super) readers: Vec<usize>,
    topic: Box<dyn AnyTopic>,
}

impl WiredTopic {
    pub(super) fn new<T: Payload>(topic: &Topic<T>) -> Self {
        Self {
            name: topic.name().into(),
            address: topic.address(),
            publishers: Vec::new(),
            readers: Vec::new(),
            topic: Box::new(topic.clone()),
        }
    }

    pub(super) fn topology(&self) -> TopicTopology {
        TopicTopology {
            name: self.name.to_string(),
            depth: self.topic.depth(),
            publishers: self.publishers.clone(),
            readers: self.readers.clone(),
        }
    }
}

impl ControlPlane {
    pub(crate) fn update(&mut self, change: impl FnOnce(&mut Status)) {
        change(&mut self.status);
        self.state.update(|status| *status = self.status);
    }

    pub(crate) fn node_index(&self, name: &str) -> Result<usize, KnobRefusal> {
        let known = self.nodes.iter().position(|node| node.name == name);
        let names = self.nodes.iter().map(|node| &*node.name);
        known.ok_or_else(|| unknown("node", name, names))
    }

    /// Returns the name of the node with this index.
    pub(crate) fn name(&self, node: usize) -> &str {
        &self.nodes[node].name
    }

    /// Returns whether some of the nodes run in other processes.
    pub(crate) fn is_part(&self) -> bool {
        self.remote.contains(&true)
    }

    /// Returns the index of a node called `name` that runs here.
    ///
    /// # Errors
    /// The reason, with the available alternatives.
    pub(crate) fn local_index(&self, name: &str) -> Result<usize, KnobRefusal> {
        let index = self.node_index(name)?;
        if self.remote[index] {
            Err(KnobRefusal::OtherProcess(name.to_owned()))
        } else {
            Ok(index)
        }
    }

    /// Changes a knob of a topic at run time `now`; returns the one that was in force.
    ///
    /// # Errors
    /// The reason, with the available alternatives.
    pub(crate) fn set(&self, knob: &Knob, now: Time) -> Result<Knob, KnobRefusal> {
        self.check(knob)?;
        self.topic(knob.target())?.topic.set(knob, self.seed, now)
    }

    /// Checks that the topic has this knob.
    pub(super) fn check(&self, knob: &Knob) -> Result<(), KnobRefusal> {
        let topic = self.topic(knob.target())?;
        if let Some(missing) = knob.draw().and_then(Draw::missing) {
            return Err(KnobRefusal::NotLoaded(missing.file().to_owned()));
        }
        if matches!(knob, Knob::Depth { .. }) || !topic.readers.is_empty() {
            return Ok(());
        }
        let read = self.topics.iter().filter(|known| !known.readers.is_empty());
        Err(KnobRefusal::Unread {
            topic: topic.name.to_string(),
            read: read.map(|known| known.name.to_string()).collect(),
        })
    }

    /// Delivers the messages of all topics that arrive by `now`.
    pub(crate) fn deliver(&self, now: Time) {
        self.topics
            .iter()
            .for_each(|topic| topic.topic.deliver(now));
    }

    /// Returns the messages in flight on all topics that arrive after `now`, for the nodes that
    /// they trigger, in the order of arrival.
    pub(crate) fn arrivals_after(&self, now: Time) -> Vec<Arrival> {
        let mut arrivals: Vec<Arrival> = self
            .topics
            .iter()
            .flat_map(|topic| topic.topic.arrivals_after(now))
            .collect();
        arrivals.sort_by_key(|arrival| arrival.at);
        arrivals
    }

    fn topic(&self, name: &str) -> Result<&WiredTopic, KnobRefusal> {
        let known = self.topics.iter().find(|t| &*t.name == name);
        let names = self.topics.iter().map(|t| &*t.name);
        known.ok_or_else(|| unknown("topic", name, names))
    }

    /// Adds the topics that are `new` with a node, and its edges.
    pub(super) fn connect(
        &mut self,
        node: usize,
        new: Vec<WiredTopic>,
        (publishes, reads): (&[usize], &[usize]),
    ) -> Result<(), GraphError> {
        for (number, topic) in new.iter().enumerate() {
            let mut others = self.topics.iter().chain(&new[..number]);
            if others.any(|other| other.name == topic.name) {
                return Err(GraphError::DuplicateTopic(topic.name.to_string()));
            }
            if topic.topic.is_in_graph() {
                return Err(GraphError::TopicOfAnotherGraph(topic.name.to_string()));
            }
        }
        for topic in new {
            topic
                .topic
                .set_records(self.records.for_index(self.topics.len()));
            self.topics.push(topic);
        }
        for topic in publishes {
            self.topics[*topic].publishers.push(node);
        }
        for topic in reads {
            self.topics[*topic].readers.push(node);
        }
        Ok(())
    }
}

/// Returns the refusal of an unknown name of a `kind`, with the known names.
fn unknown<'n>(
    kind: &'static str,
    name: &str,
    known: impl Iterator<Item = &'n str>,
) -> KnobRefusal {
    KnobRefusal::Unknown {
        kind,
        name: name.to_owned(),
        known: known.map(str::to_owned).collect(),
    }
}
