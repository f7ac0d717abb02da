//! Looks at a run from outside.

use std::ops::Deref;

use ratelab::{
    Graph, Hz, NodeTopology, RunState, Time, TopicTopology, Topology,
    sync::{Arc, atomic::Ordering},
};

use super::{
    counters::{NodeCounters, TopicCounters},
    meter::{Distribution, Meter},
    run_counters::RunCounters,
    snapshot::{MeterView, NodeView, Snapshot, SubscriptionView, TopicView},
    telemetry_sink::TelemetrySink,
};

/// Reads a running graph from any thread, without slowing it: its figures, and the
/// [state](RunState) of the run.
///
/// ```
/// use std::thread;
/// use ratelab::{Clock, GO_ON, Graph, Hz, Inbox, Time, VirtualClock};
/// use ratelab_account::Observer;
///
/// let mut graph = Graph::new();
/// graph.node("camera", Hz::new(30.0)?, 0, |_| |_| GO_ON)?;
/// let (observer, end) = (Observer::of(&graph), Time::from_secs_f64(100.0)?);
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
    run: Arc<RunState>,
    figures: RunCounters,
}

impl Deref for Observer {
    type Target = RunState;

    fn deref(&self) -> &RunState {
        &self.run
    }
}

impl Observer {
    /// Observes `graph`: its figures count from the first call on, and cover the nodes and topics
    /// that the graph had then. All its observers read the same ones.
    pub fn of(graph: &Graph) -> Self {
        let sink = TelemetrySink::of(graph);
        Self::new(sink.run.clone(), sink.figures.clone())
    }

    pub(super) fn new(run: Arc<RunState>, figures: RunCounters) -> Self {
        Self { run, figures }
    }

    /// Reads all counters. Those of one topic or node are consistent when the graph is at
    /// rest; while it runs each is read independently.
    pub fn snapshot(&self) -> Snapshot {
        self.view(self.now(), Meter::read)
    }

    /// Reads everything as of the end of the run at run time `end`: under the real clock
    /// a tick may begin a little later than the tick that ends the run.
    pub fn snapshot_at_end(&self, end: Time) -> Snapshot {
        self.view(self.now().min(end), Meter::read)
    }

    /// The same with empty distributions: reading those is most of the work, and they
    /// change slowly.
    pub fn read_counters(&self) -> Snapshot {
        self.view(self.now(), |_| Distribution::empty())
    }

    fn view(&self, now: Time, read: fn(&Meter) -> Distribution) -> Snapshot {
        let figures = &self.figures;
        let graph = figures.topology_before();
        let rates = graph.rates(|node| figures.nodes[node].hz());
        let nodes = graph.nodes.iter().zip(&*figures.nodes).zip(rates);
        let nodes = nodes.map(|((node, figures), hz)| figures.view(node, hz, now, read));
        let topics = graph.topics.iter().zip(&*figures.topics);
        Snapshot {
            now,
            status: self.status(),
            nodes: nodes.collect(),
            topics: topics
                .map(|(topic, figures)| figures.view(topic, now, read))
                .collect(),
        }
    }

    /// The graph with the rates and depths in force.
    pub fn topology(&self) -> Topology {
        self.figures.topology()
    }
}

impl NodeCounters {
    fn view(
        &self,
        node: &NodeTopology,
        hz: Hz,
        now: Time,
        read: fn(&Meter) -> Distribution,
    ) -> NodeView {
        let meters = node.meters.iter().zip(&self.meters);
        NodeView {
            name: node.name.as_str().into(),
            priority: node.priority,
            hz,
            triggers: node.triggers.as_slice().into(),
            executor: node.executor.as_ref().and_then(|name| name.parse().ok()),
            ticks: self.ticks.load(Ordering::Relaxed),
            overruns: self.overruns.load(Ordering::Relaxed),
            busy: self.busy.load(Ordering::Relaxed),
            crashed: self.crashed.load(Ordering::Relaxed),
            remote: self.remote.load(Ordering::Relaxed),
            lateness: read(&self.lateness),
            tick_time: read(&self.tick_time),
            response: read(&self.response),
            meters: meters
                .map(|(name, meter)| MeterView {
                    name: name.clone(),
                    distribution: read(meter),
                })
                .collect(),
            push_age: self.push_age.view(now),
        }
    }
}

impl TopicCounters {
    fn view(
        &self,
        topic: &TopicTopology,
        now: Time,
        read: fn(&Meter) -> Distribution,
    ) -> TopicView {
        let readers = topic.readers.iter().zip(&self.readers);
        TopicView {
            name: topic.name.as_str().into(),
            depth: self.depth().get(),
            published: self.published.load(Ordering::Relaxed),
            lost: self.lost.load(Ordering::Relaxed),
            overtaken: self.overtaken.load(Ordering::Relaxed),
            in_flight: self.in_flight(),
            lost_lately: self.losses.lately(now),
            flights: self.flights(),
            per_second: self.window.per_second(now),
            newest: self.newest(),
            publishers: topic.publishers.clone(),
            subscriptions: readers
                .map(|(node, reader)| SubscriptionView {
                    node: *node,
                    dropped: reader.dropped.load(Ordering::Relaxed),
                    dropped_lately: reader.drops.lately(now),
                    ages: read(&reader.ages),
                })
                .collect(),
        }
    }
}
