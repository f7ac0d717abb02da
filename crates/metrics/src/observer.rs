//! Looks at a run from outside.

use std::ops::Deref;

use ratelab::{Graph, RunState, Topology, sync::Arc};

use crate::{
    accounts::{Accounts, Snapshot},
    sink::AccountSink,
};

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
    /// that the graph had then. All its observers read the same ones.
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
