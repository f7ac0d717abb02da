//! The summary of a run.

use std::time::Duration;

use ratelab::{Event, Time, TimedKnob};
use ratelab_metrics::{Distribution, NodeAccount, Observer, Snapshot, TopicAccount};

use super::{Config, RunAge};
use ratelab_system::{Silence, System, SystemFigure, Unmatched, Verdict};

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
    /// The mean over run time of the system's quadratic cost; of a run that was lost, until
    /// then.
    pub cost: Option<f64>,
    /// The system's own figures of the run.
    pub figures: Vec<SystemFigure>,
    /// Its ages with their parts, if they were [watched](super::Experiment::watch_ages).
    pub ages: Vec<RunAge>,
    /// Run time at the end.
    pub sim_time: Time,
    /// Wall time of the run.
    pub wall_time: Duration,
    /// The system's main latency.
    pub latency: Distribution,
    /// The latency of each of its chains, by their names: the data age at each output.
    pub latencies: Vec<(String, Distribution)>,
    /// The topics, in the order of their first connection.
    pub topics: Vec<TopicAccount>,
    /// The nodes, in the order of addition.
    pub nodes: Vec<NodeAccount>,
    /// Commands and ends of the run.
    pub events: Vec<Event>,
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
    /// Returns the changes of knobs before and during the run: under the virtual clock the same
    /// configuration with these gives the same run.
    pub fn knobs(&self) -> Vec<TimedKnob> {
        self.events.iter().filter_map(Event::knob).collect()
    }

    /// Returns the mean age of the pushes of the run; `None` without a push.
    pub fn push_age(&self) -> Option<MeanPushAge> {
        let mut means = self.nodes.iter().filter_map(|node| {
            Some(MeanPushAge {
                run_s: node.push_age.saw()?.mean_s(self.sim_time)?,
                late_s: node.push_age.lately(self.sim_time)?.mean_s,
            })
        });
        means.next()
    }

    /// Sets the ages of the run of `system`. Those whose parts do not sum to what the run measured
    /// itself have none.
    pub fn set_ages(&mut self, system: &dyn System, ages: Vec<RunAge>) {
        let chains = system.about().chains;
        let measured = |age: &RunAge| match &age.chain {
            Some(name) => {
                let chain = chains.iter().find(|chain| chain.name() == name)?;
                chain.mean_ms(self.sim_time, &self.chains)
            }
            None if age.is_beside => None,
            None => {
                let pushes = self.node(&age.node)?.push_age.saw()?;
                pushes.mean_s(self.sim_time).map(|seconds| seconds * 1e3)
            }
        };
        let ages = ages.into_iter().map(|age| {
            let measured = measured(&age);
            age.checked(measured)
        });
        self.ages = ages.collect();
    }

    /// Returns the nodes that never ticked, and the topics without a message.
    pub fn silence(&self) -> Silence<'_> {
        let idle = self.nodes.iter().filter(|node| node.ticks == 0);
        let unsent = self.topics.iter().filter(|topic| topic.published == 0);
        Silence {
            idle: idle.map(|node| &*node.name).collect(),
            unsent: unsent.map(|topic| &*topic.name).collect(),
            unmatched: self.unmatched().collect(),
        }
    }

    /// Returns the nodes that never ticked although their match took messages of each topic.
    fn unmatched(&self) -> impl Iterator<Item = Unmatched<'_>> {
        self.nodes
            .iter()
            .enumerate()
            .filter(|(_, node)| node.ticks == 0 && node.triggers.len() > 1)
            .filter_map(|(index, node)| {
                let topics = node.triggers.iter().map(|topic| {
                    let topic = self.topics.get(*topic)?;
                    let took = topic
                        .readers
                        .iter()
                        .any(|reader| reader.node == index && reader.unmatched > 0);
                    took.then_some(&*topic.name)
                });
                Some(Unmatched {
                    node: &node.name,
                    topics: topics.collect::<Option<_>>()?,
                })
            })
    }

    /// Returns the chains of `system` through which no data came, each with the reason.
    pub fn without_data(&self, system: &dyn System) -> Vec<String> {
        let silence = self.silence();
        let chains = system.about().chains.iter();
        let silent = chains.filter_map(|chain| {
            let why = chain.without_data(self.sim_time, &self.chains, &silence)?;
            Some(format!("{}: {why}", chain.name()))
        });
        silent.collect()
    }

    /// Returns the latencies of the chains of `system` beside its main one, by their names.
    pub fn chain_latencies<'s>(
        &'s self,
        system: &'s dyn System,
    ) -> impl Iterator<Item = (&'s str, &'s Distribution)> {
        let main = system.latency();
        let others = system
            .about()
            .chains
            .iter()
            .filter(move |chain| main != Some((chain.last(), chain.name())));
        others.filter_map(|chain| {
            let mut latencies = self.latencies.iter();
            let (name, latency) = latencies.find(|(name, _)| *name == chain.name())?;
            Some((&**name, latency))
        })
    }

    /// Returns the node called `name`.
    pub fn node(&self, name: &str) -> Option<&NodeAccount> {
        self.nodes.iter().find(|node| *node.name == *name)
    }

    /// Returns the topic called `name`.
    pub fn topic(&self, name: &str) -> Option<&TopicAccount> {
        self.topics.iter().find(|topic| *topic.name == *name)
    }

    /// Creates an empty summary of a run of `config`, until the `verdict`.
    pub fn new(config: &Config, verdict: Verdict) -> Self {
        Self {
            config: config.clone(),
            sim_time: verdict.at,
            verdict,
            steps: 0,
            last_step: None,
            state: Vec::new(),
            chains: Vec::new(),
            cost: None,
            figures: Vec::new(),
            ages: Vec::new(),
            wall_time: Duration::ZERO,
            latency: Distribution::default(),
            latencies: Vec::new(),
            topics: Vec::new(),
            nodes: Vec::new(),
            events: Vec::new(),
        }
    }

    /// This summary with the figures of `observer`.
    #[must_use]
    pub fn observed(self, system: &dyn System, observer: &Observer) -> Self {
        let mut snapshot = observer.snapshot();
        // Under the real clock a tick may begin a little later than the one that ends the run.
        snapshot.now = snapshot.now.min(self.sim_time);
        let steps = system
            .states_topic()
            .and_then(|state| snapshot.topic(state));
        Self {
            steps: steps.map_or(0, |topic| topic.published),
            last_step: steps.and_then(|topic| topic.newest),
            latency: latency(system, &snapshot),
            latencies: latencies(system, &snapshot),
            topics: snapshot.topics,
            nodes: snapshot.nodes,
            events: observer.events(0),
            ..self
        }
    }
}

/// Returns the main latency of `system`.
fn latency(system: &dyn System, snapshot: &Snapshot) -> Distribution {
    let meter = system.latency();
    meter
        .and_then(|(node, meter)| snapshot.meter(node, meter))
        .cloned()
        .unwrap_or_default()
}

/// Returns the latencies of the chains of `system`.
fn latencies(system: &dyn System, snapshot: &Snapshot) -> Vec<(String, Distribution)> {
    let latencies = system.about().chains.iter().map(|chain| {
        let distribution = snapshot.meter(chain.last(), chain.name());
        (
            chain.name().to_owned(),
            distribution.cloned().unwrap_or_default(),
        )
    });
    latencies.collect()
}
