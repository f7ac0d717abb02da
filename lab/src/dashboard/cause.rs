//! Why a run was lost, from figures that were measured.
//!
//! Between a reading and the action that it led to lies a period of each node on its
//! way at the most. So readings that are older have a slow node on their path, and
//! the slowest is named with the setting that cures it.

use std::time::Duration;

use ratelab::{
    experiment::Config,
    runtime::{ClockKind, KnobKind, Snapshot, telemetry::TopicView},
    system::System,
};

use super::frame::AgeData;

/// What is known of a run that was lost.
#[derive(Clone, Debug)]
pub struct Facts {
    /// Why it is lost at any rate, if it is.
    pub anyway: Option<String>,
    /// The push age of late, if it is known.
    pub age: Option<AgeData>,
    /// Age of the oldest reading behind a state of the last second; `None` if none
    /// was behind any.
    pub oldest: Option<Duration>,
    /// The nodes on the path of a reading, up to the one that makes the states.
    pub path: Vec<NodeFacts>,
    /// Period of the node that makes the states.
    pub step: Duration,
    /// How long a decision is made to take.
    pub think: Duration,
}

/// How often a node works.
#[derive(Clone, Debug)]
pub struct NodeFacts {
    /// Its name.
    pub name: String,
    /// The knob of its rate.
    pub setting: String,
    /// One period at its rate.
    pub period: Duration,
    /// Ticks so far.
    pub ticks: u64,
    /// Periods skipped because it was still busy.
    pub overruns: u64,
    /// What it reads.
    pub input: Option<Input>,
}

/// A topic as its reader has it.
#[derive(Clone, Copy, Debug)]
pub struct Input {
    /// Shortest period of those who publish.
    pub period: Duration,
    /// How many messages it keeps.
    pub depth: usize,
    /// Messages lost unread.
    pub dropped: u64,
}

impl NodeFacts {
    /// Mean time between two ticks, with the periods that were skipped.
    fn interval(&self) -> Duration {
        let periods = self.ticks + self.overruns;
        self.period
            .mul_f64(periods as f64 / self.ticks.max(1) as f64)
    }

    /// Whether overruns keep it from its rate; a few do not.
    fn is_overrun(&self) -> bool {
        self.overruns > self.ticks / 10
    }

    /// What its queue shows of it being slower than those who fill the queue.
    fn symptom(&self) -> Option<String> {
        let input = self.input.filter(|input| input.period < self.interval())?;
        let symptom = match (input.dropped, input.depth) {
            (0, 1) => return None,
            (0, depth) => format!("a queue of {depth} hides the symptom"),
            (dropped, _) => format!("{dropped} dropped readings are the symptom"),
        };
        Some(format!("{symptom}, latency is the disease"))
    }
}

/// Share of the slowest interval from which on another is as slow.
const AS_SLOW: f64 = 0.9;

impl Facts {
    /// What `graph` says of a run of `config` whose oldest reading of late was so
    /// old; `None` for a system that does not know how old its readings are.
    pub fn of(
        system: &dyn System,
        config: &Config,
        graph: &Snapshot,
        oldest: Option<Duration>,
    ) -> Option<Self> {
        system.latency()?;
        let states = graph.topic(system.state()?)?;
        let last = *states.publishers.first()?;
        let path = upstream(graph, last).into_iter();
        Some(Self {
            anyway: system.lost_anyway(&config.setup),
            age: None,
            oldest,
            path: path.map(|node| node_facts(system, graph, node)).collect(),
            step: graph.nodes.get(last)?.hz.period(),
            think: config.think,
        })
    }

    /// Why it was lost, in short lines: first the cause and its cure.
    pub fn reasons(&self) -> Vec<String> {
        if let Some(anyway) = &self.anyway {
            return vec![anyway.clone()];
        }
        let Some(oldest) = self.oldest else {
            return vec!["no action was applied in the last second".to_owned()];
        };
        // However fast all are, a reading may wait a step for each node after it.
        if oldest <= self.step * count(self.path.len()) {
            return vec![format!(
                "data age is not to blame: readings were at most {} old",
                ms(oldest)
            )];
        }
        let slow = self.slow_nodes(oldest);
        let mut reasons: Vec<String> = slow.iter().flat_map(|node| self.blame(node)).collect();
        reasons.push(format!(
            "the last actions used readings up to {} old",
            ms(oldest)
        ));
        if slow.is_empty() {
            reasons.push("no node is that slow any more: the cure came too late".to_owned());
        }
        reasons.extend(slow.iter().find_map(|node| node.symptom()));
        reasons
    }

    /// The slowest node on the path of readings as old as `oldest`, or those that
    /// are about as slow; none if they are too fast for that.
    fn slow_nodes(&self, oldest: Duration) -> Vec<&NodeFacts> {
        let intervals = self.path.iter().map(NodeFacts::interval);
        let slowest = intervals.max().unwrap_or_default();
        if slowest.max(self.step) * count(self.path.len() + 1) < oldest {
            return Vec::new();
        }
        let as_slow = |node: &&NodeFacts| node.interval() >= slowest.mul_f64(AS_SLOW);
        self.path.iter().filter(as_slow).collect()
    }

    /// What a slow node does, and its cure.
    fn blame(&self, node: &NodeFacts) -> Vec<String> {
        let ticks = format!("the {} ticks every {}", node.name, ms(node.interval()));
        if !node.is_overrun() {
            return vec![format!("{ticks}: raise {}", node.setting)];
        }
        let relief = if self.think.is_zero() {
            "its ticks take too long"
        } else {
            "lower --think-ms"
        };
        vec![
            format!("{ticks}, not every {}", ms(node.period)),
            format!("{} overruns: {relief}", node.overruns),
        ]
    }
}

/// The nodes whose messages reach `last`, in the order in which they were added.
fn upstream(graph: &Snapshot, last: usize) -> Vec<usize> {
    let mut path = vec![last];
    let mut next = 0;
    while let Some(&reader) = path.get(next) {
        for topic in inputs(graph, reader) {
            let new = topic.publishers.iter().filter(|node| !path.contains(node));
            let new: Vec<usize> = new.copied().collect();
            path.extend(new);
        }
        next += 1;
    }
    path.remove(0);
    path.sort_unstable();
    path
}

fn inputs(graph: &Snapshot, node: usize) -> impl Iterator<Item = &TopicView> {
    let topics = graph.topics.iter();
    topics.filter(move |topic| topic.subscriptions.iter().any(|reader| reader.node == node))
}

/// How often a node works. Overruns are those of the real clock, and say nothing of
/// a run that was handed over since.
fn node_facts(system: &dyn System, graph: &Snapshot, index: usize) -> NodeFacts {
    let node = &graph.nodes[index];
    let real = graph.status.clock == ClockKind::Real;
    let of_node = [(KnobKind::Rate, &*node.name)];
    let mut aliases = system.aliases().iter();
    let alias = aliases.find(|alias| alias.knobs == of_node);
    let setting = alias.map_or_else(
        || format!("rate {}", node.name),
        |alias| alias.name.to_owned(),
    );
    let input = inputs(graph, index).max_by_key(|topic| topic.dropped());
    NodeFacts {
        name: node.name.to_string(),
        setting,
        period: node.hz.period(),
        ticks: node.ticks,
        overruns: if real { node.overruns } else { 0 },
        input: input.and_then(|topic| {
            let publishers = topic.publishers.iter();
            let periods = publishers.map(|node| graph.nodes[*node].hz.period());
            Some(Input {
                period: periods.min()?,
                depth: topic.depth,
                dropped: topic.dropped(),
            })
        }),
    }
}

fn count(nodes: usize) -> u32 {
    u32::try_from(nodes).unwrap_or(u32::MAX)
}

fn ms(duration: Duration) -> String {
    format!("{:.0} ms", duration.as_secs_f64() * 1e3)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn millis(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    fn node(name: &str, setting: &str, period: u64) -> NodeFacts {
        NodeFacts {
            name: name.to_owned(),
            setting: setting.to_owned(),
            period: millis(period),
            ticks: 10,
            overruns: 0,
            input: None,
        }
    }

    /// A run that was lost with a sensor and a policy of such periods, 20 ms for
    /// each step, and a queue between the two.
    fn lost(oldest: u64, sensor: u64, policy: u64, (depth, dropped): (usize, u64)) -> Facts {
        let input = Input {
            period: millis(sensor),
            depth,
            dropped,
        };
        let policy = NodeFacts {
            input: Some(input),
            ..node("policy", "control-hz", policy)
        };
        Facts {
            anyway: None,
            age: None,
            oldest: Some(millis(oldest)),
            path: vec![node("sensor", "sensor-hz", sensor), policy],
            step: millis(20),
            think: Duration::ZERO,
        }
    }

    fn explained(facts: &Facts, expected: &[&str]) {
        assert_eq!(facts.reasons(), expected, "{facts:?}");
    }

    const OLD: &str = "the last actions used readings up to 180 ms old";

    #[test]
    fn a_slow_policy_is_named_with_what_the_queue_shows_of_it() {
        let cause = "the policy ticks every 200 ms: raise control-hz";
        let symptom = "37 dropped readings are the symptom, latency is the disease";
        explained(&lost(180, 20, 200, (1, 37)), &[cause, OLD, symptom]);
        let hidden = "a queue of 100 hides the symptom, latency is the disease";
        explained(&lost(180, 20, 200, (100, 0)), &[cause, OLD, hidden]);
        explained(&lost(180, 20, 200, (1, 0)), &[cause, OLD]);
    }

    #[test]
    fn a_slow_sensor_is_named_and_neither_the_policy_nor_the_queue() {
        let cause = "the sensor ticks every 200 ms: raise sensor-hz";
        for queue in [(1, 0), (100, 0), (1, 3)] {
            explained(&lost(180, 200, 20, queue), &[cause, OLD]);
        }
    }

    #[test]
    fn a_sensor_and_a_policy_that_are_as_slow_are_both_named() {
        explained(
            &lost(260, 143, 143, (100, 0)),
            &[
                "the sensor ticks every 143 ms: raise sensor-hz",
                "the policy ticks every 143 ms: raise control-hz",
                "the last actions used readings up to 260 ms old",
            ],
        );
    }

    #[test]
    fn overruns_count_and_not_the_rate_that_was_set() {
        let mut facts = lost(140, 20, 20, (1, 30));
        (facts.path[1].ticks, facts.path[1].overruns) = (13, 39);
        facts.think = millis(60);
        let cause = "the policy ticks every 80 ms, not every 20 ms";
        let age = "the last actions used readings up to 140 ms old";
        let symptom = "30 dropped readings are the symptom, latency is the disease";
        explained(
            &facts,
            &[cause, "39 overruns: lower --think-ms", age, symptom],
        );
        facts.think = Duration::ZERO;
        explained(
            &facts,
            &[cause, "39 overruns: its ticks take too long", age, symptom],
        );
    }

    #[test]
    fn a_node_that_is_fast_again_is_not_blamed() {
        let cured = "no node is that slow any more: the cure came too late";
        explained(&lost(180, 20, 20, (1, 0)), &[OLD, cured]);
    }

    #[test]
    fn fresh_readings_are_not_blamed() {
        for age in [0, 20, 40] {
            let fresh = format!("data age is not to blame: readings were at most {age} ms old");
            explained(&lost(age, 20, 20, (1, 0)), &[&fresh]);
        }
    }

    #[test]
    fn what_is_lost_anyway_is_blamed_on_nothing_else() {
        let anyway = "the zero policy balances at no rate";
        let facts = Facts {
            anyway: Some(anyway.to_owned()),
            ..lost(180, 20, 200, (1, 37))
        };
        explained(&facts, &[anyway]);
    }

    #[test]
    fn without_an_action_there_is_no_age() {
        let silent = Facts {
            oldest: None,
            ..lost(0, 20, 2_000, (1, 0))
        };
        explained(&silent, &["no action was applied in the last second"]);
    }
}
