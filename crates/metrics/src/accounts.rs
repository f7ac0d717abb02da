//! The accounts of a run: filled by the sink of its records, copied at one moment, and read by an
//! observer from outside.

use std::{any::Any, ops::Deref, sync::OnceLock, time::Duration};

use ratelab::{
    Graph, Head, MessageId, NodeRecord, RunState, Sink, Status, Time, TopicRecord, Topology,
    sync::{Arc, Mutex, MutexGuard, lock},
};

use crate::{
    distribution::Distribution,
    node::{NodeAccount, TickCauses, TickRecord, TopicRead},
    tap::Listeners,
    topic::TopicAccount,
};

/// The accounts of all nodes and topics of a run, by their indices: the one fold over its
/// records. Each has a lock of its own, which a record and a look hold for a moment.
#[derive(Debug)]
pub(crate) struct Accounts {
    /// The graph before the first record.
    pub(crate) topology: Topology,
    nodes: Vec<Mutex<NodeAccount>>,
    topics: Vec<Mutex<TopicAccount>>,
}

impl Accounts {
    /// Accounts before the first record for a graph with this `topology`, all of whose nodes run
    /// here.
    pub(crate) fn new(topology: Topology) -> Self {
        let nodes = topology.nodes.iter().map(NodeAccount::new);
        let topics = topology.topics.iter().map(TopicAccount::new);
        Self {
            nodes: nodes.map(Mutex::new).collect(),
            topics: topics.map(Mutex::new).collect(),
            topology,
        }
    }

    /// Accounts for a graph as it is.
    pub(crate) fn from_graph(graph: &Graph) -> Self {
        let accounts = Self::new(graph.topology());
        for (index, node) in accounts.nodes.iter().enumerate() {
            let mut node = lock(node);
            node.crashed = graph.is_crashed(index);
            node.remote = !graph.is_here(index);
        }
        accounts
    }

    /// Returns the account of a node. Nodes that were added to the graph later have none.
    pub(crate) fn node(&self, index: usize) -> Option<MutexGuard<'_, NodeAccount>> {
        self.nodes.get(index).map(lock)
    }

    /// Returns the account of a topic. Topics that were added to the graph later have none.
    pub(crate) fn topic(&self, index: usize) -> Option<MutexGuard<'_, TopicAccount>> {
        self.topics.get(index).map(lock)
    }

    /// Returns all accounts, at run time `now`.
    pub(crate) fn snapshot(&self, now: Time, status: Status) -> Snapshot {
        let nodes = self.nodes.iter().map(|node| lock(node).clone());
        let mut nodes: Vec<NodeAccount> = nodes.collect();
        let rates = self.topology.rates(|node| nodes[node].hz);
        nodes
            .iter_mut()
            .zip(rates)
            .for_each(|(node, hz)| node.hz = hz);
        Snapshot {
            now,
            status,
            nodes,
            topics: self
                .topics
                .iter()
                .map(|topic| lock(topic).clone())
                .collect(),
        }
    }
}

/// A graph with its accounts at one moment: structure and figures, without locks.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// Run time of the last tick or command.
    pub now: Time,
    /// The state of the graph's clock.
    pub status: Status,
    /// The nodes, in the order of addition.
    pub nodes: Vec<NodeAccount>,
    /// The topics, in the order of their first connection.
    pub topics: Vec<TopicAccount>,
}

impl Snapshot {
    /// Returns the node called `name`.
    pub fn node(&self, name: &str) -> Option<&NodeAccount> {
        self.nodes.iter().find(|node| &*node.name == name)
    }

    /// Returns the measurement `name` of the node called `node`.
    pub fn meter(&self, node: &str, name: &str) -> Option<&Distribution> {
        self.node(node)?.meter(name)
    }

    /// Returns the period of the node called `name`; zero if there is none.
    pub fn period(&self, name: &str) -> Duration {
        self.node(name)
            .map_or(Duration::ZERO, |node| node.hz.period())
    }

    /// Returns the topic called `name`.
    pub fn topic(&self, name: &str) -> Option<&TopicAccount> {
        self.topics.iter().find(|topic| &*topic.name == name)
    }
}

/// Adds the records of a graph to its accounts, and hands out copies.
pub(crate) struct AccountSink {
    pub(crate) run: Arc<RunState>,
    pub(crate) accounts: Arc<Accounts>,
    /// The listeners to the ticks of each node.
    pub(crate) ticks: Vec<Listeners<Box<TickListener>>>,
    /// The listeners to each topic.
    pub(crate) topics: Vec<Listeners<Box<MessageListener>>>,
    /// A sink that gets each record before.
    pub(crate) first: OnceLock<Arc<dyn Sink>>,
}

/// Takes a message with its payload; returns `false` once nobody listens any more.
pub(crate) type MessageListener = dyn FnMut(&Head, &dyn Any) -> bool + Send;

/// Takes a tick; returns `false` once nobody listens any more.
pub(crate) type TickListener = dyn FnMut(&TickRecord) -> bool + Send;

impl AccountSink {
    /// Returns the sink of `graph`, from now on if it had none. Covers the nodes and topics that
    /// the graph has at this moment. Beside a sink of another kind it gets nothing.
    pub(crate) fn from_graph(graph: &Graph) -> Arc<Self> {
        let sink: Arc<dyn Any + Send + Sync> = graph.sink_or(|| Arc::new(Self::new(graph)));
        let known = sink.downcast::<Self>();
        known.unwrap_or_else(|_| Arc::new(Self::new(graph)))
    }

    fn new(graph: &Graph) -> Self {
        let accounts = Accounts::from_graph(graph);
        let (nodes, topics) = (&accounts.topology.nodes, &accounts.topology.topics);
        Self {
            run: graph.state(),
            ticks: nodes.iter().map(|_| Listeners::default()).collect(),
            topics: topics.iter().map(|_| Listeners::default()).collect(),
            accounts: accounts.into(),
            first: OnceLock::new(),
        }
    }
}

impl AccountSink {
    /// Adds a cause of the next tick of a node. It is kept although nobody may listen: a tap may come
    /// before the tick is over.
    fn cause(&self, topic: usize, reader: usize, add: impl FnOnce(&mut NodeAccount)) {
        let topic = &self.accounts.topology.topics[topic];
        let node = topic.readers.get(reader);
        if let Some(mut account) = node.and_then(|node| self.accounts.node(*node)) {
            add(&mut account);
        }
    }
}

impl Sink for AccountSink {
    fn node(&self, node: usize, record: &NodeRecord) {
        if let Some(first) = self.first.get() {
            first.node(node, record);
        }
        let Some(mut account) = self.accounts.node(node) else {
            return;
        };
        account.add(record);
        if let NodeRecord::Ticked(times) = record {
            if !self.ticks[node].are_any() {
                account.causes = TickCauses::default();
                return;
            }
            let tick = account.newest_tick(times);
            // The run may wait for a full tap, but not with a lock.
            drop(account);
            self.ticks[node].each(|listener| listener(&tick));
        }
    }

    fn topic(&self, topic: usize, record: &TopicRecord<'_>) {
        if let Some(first) = self.first.get() {
            first.topic(topic, record);
        }
        let Some(mut account) = self.accounts.topic(topic) else {
            return;
        };
        account.add(record);
        drop(account);
        match record {
            TopicRecord::Sent { head, payload, .. } => {
                self.topics[topic].each(|listener| listener(head, *payload));
            }
            &TopicRecord::Read {
                reader,
                seq,
                newest,
                ..
            } => {
                let message = MessageId { topic, seq };
                let read = TopicRead {
                    message,
                    reader,
                    newest,
                };
                self.cause(topic, reader, |node| node.causes.reads.push(read));
            }
            &TopicRecord::Matched {
                reader,
                completes: true,
                ..
            } => self.cause(topic, reader, |node| {
                node.causes.completed = (node.triggers.len() > 1).then_some(topic);
            }),
            _ => {}
        }
    }
}

/// Reads a running graph from any thread, without slowing it: its accounts, and the
/// [state](RunState) of the run.
///
/// ```
/// use std::thread;
/// use ratelab::{Clock, Graph, Hz, Inbox, Tick, Time, VirtualClock};
/// use ratelab_metrics::Observer;
///
/// let mut graph = Graph::new();
/// graph.node("camera", Hz::new(30.0)?, 0, |_| |_: &mut Tick| {})?;
/// let (observer, end) = (Observer::new(&graph), Time::from_secs_f64(100.0)?);
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
    pub(crate) run: Arc<RunState>,
    pub(crate) accounts: Arc<Accounts>,
}

impl Deref for Observer {
    type Target = RunState;

    fn deref(&self) -> &RunState {
        &self.run
    }
}

impl Observer {
    /// Observes `graph`: its accounts begin with the first call, and cover the nodes and topics
    /// that the graph had then. All its observers read the same ones. A graph has one sink: if it
    /// already has one of another kind, all figures stay at zero.
    pub fn new(graph: &Graph) -> Self {
        let sink = AccountSink::from_graph(graph);
        Self {
            run: sink.run.clone(),
            accounts: sink.accounts.clone(),
        }
    }

    /// Reads all accounts. They are consistent with each other when the graph is at rest; while
    /// it runs each is read at a moment of its own.
    pub fn snapshot(&self) -> Snapshot {
        self.accounts.snapshot(self.now(), self.status())
    }

    /// Returns the graph with the rates and depths in force.
    pub fn topology(&self) -> Topology {
        let (mut topology, now) = (self.accounts.topology.clone(), self.snapshot());
        for (node, account) in topology.nodes.iter_mut().zip(&now.nodes) {
            node.hz = account.hz;
        }
        for (topic, account) in topology.topics.iter_mut().zip(&now.topics) {
            topic.depth = account.depth;
        }
        topology
    }
}
