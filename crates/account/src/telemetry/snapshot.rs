//! The figures of a run at one moment, as plain values.

use std::time::Duration;

use ratelab::{Hz, Status, Time, sync::Arc};
use ratelab_effects::Executor;

use super::{counters::Flight, meter::Distribution, push_age::PushAgeView};

/// A graph with its counters at one moment: structure and figures, without locks.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// Run time of the last tick or command.
    pub now: Time,
    /// The state of the graph's clock.
    pub status: Status,
    /// The nodes, in the order of addition.
    pub nodes: Vec<NodeView>,
    /// The topics, in the order of their first connection.
    pub topics: Vec<TopicView>,
}

/// A node in a [`Snapshot`].
#[derive(Clone, Debug)]
pub struct NodeView {
    /// Its name.
    pub name: Arc<str>,
    /// Priority among nodes that are due at the same instant, lowest first.
    pub priority: u32,
    /// The rate in force; that of the messages for a node that they trigger.
    pub hz: Hz,
    /// The topics that trigger it, as indices into [`Snapshot::topics`]; empty for a node
    /// at a rate.
    pub triggers: Arc<[usize]>,
    /// Its executor; `None` for a thread of its own.
    pub executor: Option<Executor>,
    /// Ticks so far, with the one that it is in.
    pub ticks: u64,
    /// Periods skipped because the node was still busy.
    pub overruns: u64,
    /// Whether it is in a tick. In virtual time ticks take no time unless a duration is
    /// set.
    pub busy: bool,
    /// Whether it crashed without a restart since.
    pub crashed: bool,
    /// Whether it runs in another process, which has its figures.
    pub remote: bool,
    /// Lateness of ticks. In virtual time it is measured only where a lateness is set.
    pub lateness: Distribution,
    /// Duration of ticks: in run time where a duration is set, otherwise in wall time.
    /// The wall time is not measured while the virtual clock runs at unlimited speed.
    pub tick_time: Distribution,
    /// Response time: from the due time to the end of a tick, lateness plus tick time.
    pub response: Distribution,
    /// The node's own measurements.
    pub meters: Vec<MeterView>,
    /// Age of the sensing behind the node's pushes on the world, if it makes any.
    pub push_age: Option<PushAgeView>,
}

/// A node's own measurement in a [`Snapshot`].
#[derive(Clone, Debug)]
pub struct MeterView {
    /// Name of the measurement.
    pub name: String,
    /// The figures.
    pub distribution: Distribution,
}

/// A topic in a [`Snapshot`].
#[derive(Clone, Debug)]
pub struct TopicView {
    /// Its name.
    pub name: Arc<str>,
    /// Queue depth.
    pub depth: usize,
    /// Messages published so far.
    pub published: u64,
    /// Messages lost by its link.
    pub lost: u64,
    /// Messages that its link delivered after a newer one: these are never read.
    pub overtaken: u64,
    /// Messages in flight at the last publication or reading, or at the end of the run.
    pub in_flight: u64,
    /// Messages that its link lost within the last second.
    pub lost_lately: u64,
    /// Recent ways of messages through its link; empty without one.
    pub flights: Vec<Flight>,
    /// Messages per second over the last second.
    pub per_second: f64,
    /// Run time of the newest message; `None` before the first.
    pub newest: Option<Time>,
    /// The nodes that publish to it, as indices into [`Snapshot::nodes`].
    pub publishers: Vec<usize>,
    /// The subscriptions.
    pub subscriptions: Vec<SubscriptionView>,
}

impl TopicView {
    /// Mean messages per second of a run up to `now`.
    pub fn average(&self, now: Time) -> f64 {
        let seconds = now.as_secs_f64();
        if seconds > 0.0 {
            self.published as f64 / seconds
        } else {
            0.0
        }
    }

    /// Messages lost unread, over all subscriptions.
    pub fn dropped(&self) -> u64 {
        self.subscriptions.iter().map(|s| s.dropped).sum()
    }

    /// Of these, messages lost within the last second.
    pub fn dropped_lately(&self) -> u64 {
        self.subscriptions.iter().map(|s| s.dropped_lately).sum()
    }
}

/// A subscription in a [`Snapshot`].
#[derive(Clone, Debug)]
pub struct SubscriptionView {
    /// The reading node, as an index into [`Snapshot::nodes`].
    pub node: usize,
    /// Messages evicted before the subscription saw them.
    pub dropped: u64,
    /// Of these, messages evicted within the last second.
    pub dropped_lately: u64,
    /// Ages of messages when the subscription read them.
    pub ages: Distribution,
}

impl Snapshot {
    /// The node called `name`.
    pub fn node(&self, name: &str) -> Option<&NodeView> {
        self.nodes.iter().find(|node| &*node.name == name)
    }

    /// The measurement `name` of the node called `node`.
    pub fn meter(&self, node: &str, name: &str) -> Option<&Distribution> {
        let meters = &self.node(node)?.meters;
        let meter = meters.iter().find(|meter| meter.name == name)?;
        Some(&meter.distribution)
    }

    /// The period of the node called `name`; zero if there is none.
    pub fn period(&self, name: &str) -> Duration {
        self.node(name)
            .map_or(Duration::ZERO, |node| node.hz.period())
    }

    /// The topic called `name`.
    pub fn topic(&self, name: &str) -> Option<&TopicView> {
        self.topics.iter().find(|topic| &*topic.name == name)
    }
}
