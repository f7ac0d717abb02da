//! The sink of a graph that is looked at: accounts, and copies for taps.

use std::{any::Any, sync::OnceLock};

use ratelab::{Graph, Head, MessageId, NodeRecord, RunState, Sink, TopicRecord, sync::Arc};

use crate::{
    accounts::Accounts,
    node::{NodeAccount, TickCauses, TickRecord, TopicRead},
    tap::Listeners,
};

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
