//! The summary of a run.

use std::time::Duration;

use ratelab::{Event, Hz, Interrupt, Time, TimedKnob};
use ratelab_account::{Distribution, NodeAccount, Observer, Snapshot, TopicAccount};

use super::Config;
use crate::system::{System, Verdict};

/// The summary of a run.
#[derive(Clone, Debug)]
pub struct Summary {
    /// Configuration of the run.
    pub config: Config,
    /// Verdict on the run.
    pub verdict: Verdict,
    /// Steps of the plant: messages on the system's topic of states.
    pub steps: u64,
    /// Run time of the last step; `None` without one.
    pub last_step: Option<Time>,
    /// The last state of the plant, as numbers; empty without states.
    pub state: Vec<f64>,
    /// The last data ages of its chains, as numbers; empty without chains.
    pub chains: Vec<f64>,
    /// The mean over run time of the system's
    /// quadratic cost; of a run that was lost, until then.
    pub cost: Option<f64>,
    /// Run time at the end.
    pub sim_time: Time,
    /// Wall time of the run.
    pub wall_time: Duration,
    /// The system's main latency.
    pub latency: Distribution,
    /// The topics, in the order of their first connection.
    pub topics: Vec<TopicSummary>,
    /// The nodes, in the order of addition.
    pub nodes: Vec<NodeSummary>,
    /// Commands and ends of the run.
    pub events: Vec<Event>,
}

/// A topic's figures in a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TopicSummary {
    /// Its name.
    pub name: String,
    /// Messages published.
    pub published: u64,
    /// Messages lost unread.
    pub dropped: u64,
    /// Messages lost by its link.
    pub lost: u64,
    /// Messages that its link delivered after a newer one.
    pub overtaken: u64,
    /// Messages in flight at the end.
    pub in_flight: u64,
    /// Messages per second of run time.
    pub per_second: f64,
    /// Whether a node reads it.
    pub read: bool,
}

/// A node's timing in a run.
#[derive(Clone, Debug)]
pub struct NodeSummary {
    /// Its name.
    pub name: String,
    /// Its rate at the end.
    pub hz: Hz,
    /// Number of ticks.
    pub ticks: u64,
    /// Periods skipped because it was still busy.
    pub overruns: u64,
    /// Lateness of its ticks; empty under the virtual clock unless a lateness is set.
    pub lateness: Distribution,
    /// Duration of its ticks: in run time where a duration is set, otherwise in wall
    /// time, and empty where the virtual clock ran without pacing.
    pub tick_time: Distribution,
    /// Response time: from the due time to the end of a tick.
    pub response: Distribution,
    /// The mean age of its pushes; `None` without a push.
    pub push_age: Option<MeanPushAge>,
}

/// The mean age of the push in force, over time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeanPushAge {
    /// From the first push to the end of the run (s).
    pub run_s: f64,
    /// In the last second of it (s).
    pub late_s: f64,
}

impl Summary {
    /// Whether `interrupt` stopped the run before it came to a result; its end was to be at
    /// `end`.
    pub(crate) fn is_cut_off(&self, interrupt: &Interrupt, end: Time) -> bool {
        interrupt.is_asked() && self.sim_time < end && !self.verdict.is_lost()
    }

    /// The changes of knobs before and during the run: under the virtual clock the same
    /// configuration with these gives the same run.
    pub fn knobs(&self) -> Vec<TimedKnob> {
        self.events.iter().filter_map(Event::knob).collect()
    }

    /// The mean age of the pushes of the run; `None` without a push.
    pub fn push_age(&self) -> Option<MeanPushAge> {
        self.nodes.iter().find_map(|node| node.push_age)
    }

    /// The node called `name`.
    pub fn node(&self, name: &str) -> Option<&NodeSummary> {
        self.nodes.iter().find(|node| node.name == name)
    }

    /// The topic called `name`; an empty one if there is none.
    pub fn topic(&self, name: &str) -> TopicSummary {
        let known = self.topics.iter().find(|topic| topic.name == name);
        known.cloned().unwrap_or_else(|| TopicSummary {
            name: name.to_owned(),
            ..TopicSummary::default()
        })
    }

    /// An empty summary of a run of `config`, until the `verdict`.
    pub fn of(config: &Config, verdict: Verdict) -> Self {
        Self {
            config: config.clone(),
            verdict,
            steps: 0,
            last_step: None,
            state: Vec::new(),
            chains: Vec::new(),
            cost: None,
            sim_time: verdict.at,
            wall_time: Duration::ZERO,
            latency: Distribution::empty(),
            topics: Vec::new(),
            nodes: Vec::new(),
            events: Vec::new(),
        }
    }

    /// The same with the figures of `observer`.
    #[must_use]
    pub fn observed(self, system: &dyn System, observer: &Observer) -> Self {
        let mut snapshot = observer.snapshot();
        // Under the real clock a tick may begin a little later than the one that ends the run.
        snapshot.now = snapshot.now.min(self.sim_time);
        let steps = system.state().and_then(|state| snapshot.topic(state));
        let topics = snapshot.topics.iter();
        Self {
            steps: steps.map_or(0, |topic| topic.published),
            last_step: steps.and_then(|topic| topic.newest),
            latency: latency(system, &snapshot),
            topics: topics
                .map(|topic| TopicSummary::of(topic, self.sim_time))
                .collect(),
            nodes: snapshot
                .nodes
                .iter()
                .map(|node| NodeSummary::of(node, snapshot.now))
                .collect(),
            events: observer.events(0),
            ..self
        }
    }
}

/// The main latency of `system`.
fn latency(system: &dyn System, snapshot: &Snapshot) -> Distribution {
    let meter = system.latency();
    let distribution = meter.and_then(|(node, meter)| snapshot.meter(node, meter));
    distribution.cloned().unwrap_or_else(Distribution::empty)
}

impl TopicSummary {
    fn of(topic: &TopicAccount, sim_time: Time) -> Self {
        Self {
            name: topic.name.to_string(),
            published: topic.published,
            dropped: topic.dropped(),
            lost: topic.lost,
            overtaken: topic.overtaken,
            in_flight: topic.in_flight(),
            per_second: topic.average(sim_time),
            read: !topic.readers.is_empty(),
        }
    }
}

impl NodeSummary {
    fn of(node: &NodeAccount, now: Time) -> Self {
        Self {
            name: node.name.to_string(),
            hz: node.hz,
            ticks: node.ticks,
            overruns: node.overruns,
            lateness: node.lateness.clone(),
            tick_time: node.tick_time.clone(),
            response: node.response.clone(),
            push_age: node.push_age.view(now).and_then(|age| {
                Some(MeanPushAge {
                    run_s: age.mean_s()?,
                    late_s: age.late_s?,
                })
            }),
        }
    }
}
