//! Why a run was lost, from figures that were measured.
//!
//! Between a reading and the action that it led to lies a period of each node on its
//! way at the most. So readings that are older have a slow node on their path, and
//! the slowest is named with where the age arose and the setting that cures it.

use std::time::Duration;

use ratelab::{
    experiment::Config,
    runtime::{KnobKind, Snapshot, telemetry::TopicView},
    system::System,
};

use super::frame::{AgeData, Strain};
use crate::timing::takes_time;

/// What is known of a run that was lost.
#[derive(Clone, Debug)]
pub struct Facts {
    /// Why it is lost at any rate, if it is.
    pub anyway: Option<String>,
    /// The push age of late, if it is known.
    pub age: Option<AgeData>,
    /// Whether keys turn its knobs, as in no recording.
    pub live: bool,
    /// Age of the oldest reading behind a state of the last second; `None` if none
    /// was behind any.
    pub oldest: Option<Duration>,
    /// The nodes on the path of a reading, up to the one that acts.
    pub path: Vec<NodeFacts>,
    /// Period of the node that acts.
    pub step: Duration,
}

/// How often a node works.
#[derive(Clone, Debug)]
pub struct NodeFacts {
    /// Its name.
    pub name: String,
    /// The knob of its rate.
    pub setting: String,
    /// The key that turns it up, if one does.
    pub key: Option<char>,
    /// The topic through which what it publishes is read.
    pub output: Option<String>,
    /// One period at its rate.
    pub period: Duration,
    /// Ticks so far.
    pub ticks: u64,
    /// Periods skipped because it was still busy.
    pub overruns: u64,
    /// Whether a knob says what its ticks take.
    pub takes: bool,
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
        match (input.dropped, input.depth) {
            (0, 1) => None,
            (0, depth) => Some(format!(
                "a queue of {depth} drops nothing and changes nothing"
            )),
            (dropped, _) => Some(format!(
                "{dropped} dropped readings are harmless: a deeper queue changes nothing"
            )),
        }
    }
}

/// The keys that turn up the rates of the first aliases.
const RATE_KEYS: [char; 2] = [']', '}'];

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
        let (acts, _) = system.latency()?;
        let last = graph.nodes.iter().position(|node| *node.name == *acts)?;
        let path = upstream(graph, last).into_iter();
        Some(Self {
            anyway: system.lost_anyway(&config.setup),
            age: None,
            live: false,
            oldest,
            path: path
                .map(|node| node_facts(system, config, graph, node))
                .collect(),
            step: graph.nodes.get(last)?.hz.period(),
        })
    }

    /// Why it was lost, in short lines: first the cause and its cure.
    pub fn reasons(&self) -> Vec<String> {
        let fresh = self.fresh();
        if let Some(anyway) = &self.anyway {
            let fresh = fresh.filter(|_| self.age.is_some());
            return vec![
                fresh.map_or_else(|| anyway.clone(), |fresh| format!("{fresh}: {anyway}")),
            ];
        }
        let Some(oldest) = self.oldest else {
            return vec!["no action was applied in the last second".to_owned()];
        };
        if let Some(fresh) = fresh {
            return vec![fresh];
        }
        let slow = self.slow_nodes(oldest);
        let mut reasons: Vec<String> = slow.iter().flat_map(|node| self.blame(node)).collect();
        reasons.push(self.how_old(oldest));
        if slow.is_empty() {
            reasons.push("no node is that slow any more: the cure came too late".to_owned());
        }
        reasons.extend(slow.iter().find_map(|node| node.symptom()));
        reasons
    }

    /// That age is not to blame, if it is not: the loop bears more, or, where that
    /// is unknown, each node added a step at the most.
    fn fresh(&self) -> Option<String> {
        let limit = self.age.and_then(|age| Some((age, age.limit()?)));
        match limit {
            Some((age, limit)) if age.strain() == Strain::Borne && age.greatest < limit => {
                let mean = number(age.mean);
                Some(format!(
                    "age is not to blame ({mean} ms of {})",
                    number(limit)
                ))
            }
            Some(_) => None,
            None => {
                let oldest = self.oldest?;
                let fresh = oldest <= self.step * count(self.path.len());
                let oldest = ms(oldest);
                fresh.then(|| {
                    format!("data age is not to blame: readings were at most {oldest} old")
                })
            }
        }
    }

    /// How old readings were, against what the loop bears.
    fn how_old(&self, oldest: Duration) -> String {
        let Some(age) = self.age else {
            return format!("the last actions used readings up to {} old", ms(oldest));
        };
        let (greatest, mean) = (ms(age.greatest), number(age.mean));
        let text = format!("pushes used readings up to {greatest} old, {mean} on average");
        match age.limit() {
            Some(limit) => format!("{text}; this loop bears {}", number(limit)),
            None => text,
        }
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

    /// Where the age arose, and its cure.
    fn blame(&self, node: &NodeFacts) -> Vec<String> {
        let (name, every) = (&node.name, ms(node.interval()));
        if node.is_overrun() {
            let relief = match node.takes {
                true => format!("lower takes {name}"),
                false => "its ticks take too long".to_owned(),
            };
            let set = ms(node.period);
            return vec![
                format!("the age arose in the {name}: it decides every {every}, not every {set}"),
                format!("{} overruns: {relief}", node.overruns),
            ];
        }
        let cure = match node.key.filter(|_| self.live) {
            Some(key) => format!("{key} raises {}", node.setting),
            None => format!("raise {}", node.setting),
        };
        let arose = match (&node.input, &node.output) {
            (Some(_), Some(topic)) => format!("on {topic}: the {name} decides every {every}"),
            (Some(_), None) => format!("in the {name}: it decides every {every}"),
            (None, _) => {
                let times = 1.0 / node.interval().as_secs_f64();
                let times = (times * 10.0).round() / 10.0;
                format!("at the {name}: it looks only {times} times a second")
            }
        };
        vec![format!("the age arose {arose}. {cure}")]
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

/// How often a node works.
fn node_facts(system: &dyn System, config: &Config, graph: &Snapshot, index: usize) -> NodeFacts {
    let node = &graph.nodes[index];
    let of_node = [(KnobKind::Rate, &*node.name)];
    let aliases = system.aliases().iter();
    let mut rates = aliases
        .filter(|alias| alias.kind() == KnobKind::Rate)
        .enumerate();
    let alias = rates.find(|(_, alias)| alias.knobs == of_node);
    let setting = alias.map_or_else(
        || format!("rate {}", node.name),
        |(_, alias)| alias.name.to_owned(),
    );
    let read = |topic: &&TopicView| !topic.subscriptions.is_empty();
    let mut outputs = graph.topics.iter().filter(read);
    let output = outputs.find(|topic| topic.publishers.contains(&index));
    let input = inputs(graph, index).max_by_key(|topic| topic.dropped());
    NodeFacts {
        name: node.name.to_string(),
        setting,
        key: alias.and_then(|(number, _)| RATE_KEYS.get(number).copied()),
        output: output.map(|topic| topic.name.to_string()),
        period: node.hz.period(),
        ticks: node.ticks,
        overruns: node.overruns,
        takes: takes_time(&config.setup, &node.name),
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
    format!("{} ms", number(duration))
}

/// Whole milliseconds.
fn number(duration: Duration) -> String {
    format!("{:.0}", duration.as_secs_f64() * 1e3)
}

#[cfg(test)]
mod tests {
    use ratelab::system::AgeLimits;

    use super::*;

    fn millis(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    fn node(name: &str, setting: &str, period: u64) -> NodeFacts {
        NodeFacts {
            name: name.to_owned(),
            setting: setting.to_owned(),
            key: None,
            output: None,
            period: millis(period),
            ticks: 10,
            overruns: 0,
            takes: false,
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
            key: Some(']'),
            output: Some("/action".to_owned()),
            ..node("policy", "control-hz", policy)
        };
        Facts {
            anyway: None,
            age: None,
            live: true,
            oldest: Some(millis(oldest)),
            path: vec![node("sensor", "sensor-hz", sensor), policy],
            step: millis(20),
        }
    }

    fn explained(facts: &Facts, expected: &[&str]) {
        assert_eq!(facts.reasons(), expected, "{facts:?}");
    }

    const OLD: &str = "the last actions used readings up to 180 ms old";

    #[test]
    fn a_slow_policy_is_named_with_what_the_queue_shows_of_it() {
        let cause =
            "the age arose on /action: the policy decides every 200 ms. ] raises control-hz";
        let symptom = "37 dropped readings are harmless: a deeper queue changes nothing";
        explained(&lost(180, 20, 200, (1, 37)), &[cause, OLD, symptom]);
        let hidden = "a queue of 100 drops nothing and changes nothing";
        explained(&lost(180, 20, 200, (100, 0)), &[cause, OLD, hidden]);
        explained(&lost(180, 20, 200, (1, 0)), &[cause, OLD]);
    }

    #[test]
    fn a_slow_sensor_is_named_and_neither_the_policy_nor_the_queue() {
        let cause = "the age arose at the sensor: it looks only 5 times a second. raise sensor-hz";
        for queue in [(1, 0), (100, 0), (1, 3)] {
            explained(&lost(180, 200, 20, queue), &[cause, OLD]);
        }
    }

    #[test]
    fn a_sensor_and_a_policy_that_are_as_slow_are_both_named() {
        explained(
            &lost(260, 143, 143, (100, 0)),
            &[
                "the age arose at the sensor: it looks only 7 times a second. raise sensor-hz",
                "the age arose on /action: the policy decides every 143 ms. ] raises control-hz",
                "the last actions used readings up to 260 ms old",
            ],
        );
    }

    #[test]
    fn overruns_count_and_not_the_rate_that_was_set() {
        let mut facts = lost(140, 20, 20, (1, 30));
        (facts.path[1].ticks, facts.path[1].overruns) = (13, 39);
        facts.path[1].takes = true;
        let cause = "the age arose in the policy: it decides every 80 ms, not every 20 ms";
        let age = "the last actions used readings up to 140 ms old";
        let symptom = "30 dropped readings are harmless: a deeper queue changes nothing";
        explained(
            &facts,
            &[cause, "39 overruns: lower takes policy", age, symptom],
        );
        facts.path[1].takes = false;
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

    fn of_age(mean: u64, greatest: u64, facts: Facts) -> Facts {
        let limits = AgeLimits {
            grows: Some(millis(60)),
            falls: Some(millis(90)),
        };
        let age = AgeData {
            mean: millis(mean),
            greatest: millis(greatest),
            limits,
        };
        Facts {
            age: Some(age),
            ..facts
        }
    }

    #[test]
    fn an_age_is_told_against_what_the_loop_bears() {
        let old = of_age(95, 200, lost(180, 20, 200, (1, 0)));
        let [cause, age] = &old.reasons()[..] else {
            panic!("{old:?}")
        };
        assert!(cause.ends_with("] raises control-hz"), "{cause}");
        let told = "pushes used readings up to 200 ms old, 95 on average; this loop bears 90";
        assert_eq!(age, told);
        explained(
            &of_age(10, 20, lost(20, 20, 20, (1, 3))),
            &["age is not to blame (10 ms of 90)"],
        );
    }

    #[test]
    fn a_recording_obeys_no_key() {
        let facts = Facts {
            live: false,
            ..lost(180, 20, 200, (1, 0))
        };
        assert!(facts.reasons()[0].ends_with("200 ms. raise control-hz"));
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
