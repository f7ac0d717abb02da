//! The cause of a loss, from measurements.
//!
//! The age of an action is the sum of its parts. The largest part has an owner, a node or
//! a link, and a knob of the owner is the cure.

mod owner;

use std::time::Duration;

use ratelab::{
    runtime::{Hz, Knob, KnobKind, Snapshot, Time, telemetry::Lineage},
    system::{Alias, Setup, System},
};

pub use owner::{Explained, Owner};

use super::{
    frame::{AgeData, Strain},
    settings::setting,
};
use crate::names;

/// A lost run.
pub struct Facts<'a> {
    /// Its system.
    pub system: &'a dyn System,
    /// Its knobs in force.
    pub setup: &'a Setup,
    /// Those of its knobs that were turned since its start.
    pub turned: &'a Setup,
    /// Its graph and counters.
    pub graph: &'a Snapshot,
    /// The chains behind its actions.
    pub lineage: &'a Lineage,
    /// Its recent push age, if known.
    pub age: Option<AgeData>,
    /// The stretch of run time of that age.
    pub late: (Time, Time),
    /// Whether keys turn its knobs; `false` for a recording.
    pub live: bool,
}

/// The cause of a loss.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cause {
    /// The owners of its age, the most important first; empty if age is not the cause.
    pub owners: Vec<Owner>,
    /// The cause and its cure, in short lines.
    pub lines: Vec<String>,
}

/// Length of the recent stretch of run time; longer if two periods are.
const LATELY: Duration = Duration::from_secs(1);

/// The keys that raise the rates of the first aliases.
const RATE_KEYS: [char; 2] = [']', '}'];

/// Share of the longest interval at which another one counts as equally long.
const AS_SLOW: f64 = 0.9;

impl Facts<'_> {
    /// The cause of the loss; empty for a system without an age.
    pub fn cause(&self) -> Cause {
        let Some(acts) = acting(self.system, self.graph) else {
            return Cause::default();
        };
        let fresh = self.fresh();
        let anyway = self.system.lost_anyway(self.setup);
        if anyway.is_some() || fresh.is_some() {
            let why = anyway.unwrap_or_else(|| self.unequal());
            let line = fresh.map_or(why.clone(), |fresh| format!("{fresh}: {why}"));
            return Cause {
                lines: vec![line + self.another()],
                ..Cause::default()
            };
        }
        let (from, to) = self.late;
        let explained = Explained {
            lineage: self.lineage,
            graph: self.graph,
            setup: self.setup,
            from,
            to,
        };
        let owners = main_owners(&explained, acts);
        let mut lines: Vec<String> = owners
            .iter()
            .map(|owner| self.blame(*owner, &explained))
            .collect();
        if lines.is_empty() {
            lines.push("no action was applied in the last second".to_owned());
        }
        lines.extend(self.how_old());
        lines.extend(owners.iter().find_map(|owner| self.symptom(*owner)));
        Cause { owners, lines }
    }

    /// States that age is not the cause, if it is below the limit of the loop.
    fn fresh(&self) -> Option<String> {
        let age = self.age?;
        let limit = age.limit()?;
        let fresh = age.strain() == Strain::Borne && age.greatest < limit;
        let (mean, limit) = (number(age.mean), number(limit));
        fresh.then(|| format!("age is not to blame ({mean} ms of {limit})"))
    }

    /// States that the message in force, such as a policy, does not hold the system.
    fn unequal(&self) -> String {
        match self.choice() {
            Some(alias) => {
                let what = setting(self.system, alias, self.setup);
                format!("{what} does not balance it")
            }
            None => "what decides does not balance it".to_owned(),
        }
    }

    /// The key for another message, where there are several to choose from.
    fn another(&self) -> &'static str {
        match self.choice() {
            Some(_) if self.live => ". p takes another",
            _ => "",
        }
    }

    /// The alias of the messages to choose from.
    fn choice(&self) -> Option<&'static Alias> {
        let alias = names::first_alias(self.system, KnobKind::Send);
        alias.filter(|alias| !alias.choices.is_empty())
    }

    /// The age of readings, beside the limit of the loop.
    fn how_old(&self) -> Option<String> {
        let age = self.age?;
        let (greatest, mean) = (ms(age.greatest), number(age.mean));
        let text = format!("pushes used readings up to {greatest} old, {mean} on average");
        Some(match age.limit() {
            Some(limit) => format!("{text}; this loop bears {}", number(limit)),
            None => text,
        })
    }

    /// The lateness of a node, by its thread or by its executor.
    fn blame_lateness(&self, node: usize, explained: &Explained<'_>) -> String {
        let name = self.node(node);
        if let Some(executor) = self.graph.nodes[node].executor {
            let share = self.share(Owner::Late(node), explained);
            return format!(
                "the age arose as the {name} waits for its executor {executor}{share}: quicker \
                 nodes in it help, or another executor"
            );
        }
        let cure = self.mended_by(&format!("wakes {name} none"));
        format!("the age arose in the {name}: it wakes late. {cure}")
    }

    /// The share of an owner in the age, in parentheses.
    fn share(&self, owner: Owner, explained: &Explained<'_>) -> String {
        let owners = acting(self.system, self.graph).map(|acts| explained.owners(acts));
        let owners = owners.unwrap_or_default();
        let all: Duration = owners.iter().map(|(_, took)| *took).sum();
        let own = owners.iter().find(|(known, _)| *known == owner);
        own.filter(|_| !all.is_zero())
            .map_or_else(String::new, |(_, took)| {
                let share = took.as_secs_f64() / all.as_secs_f64() * 100.0;
                format!(" ({share:.0} % of it)")
            })
    }

    /// The stage in which the age arose, and its cure.
    fn blame(&self, owner: Owner, explained: &Explained<'_>) -> String {
        match owner {
            Owner::Rate(node) => self.blame_rate(node, explained),
            Owner::Cost(node) => self.blame_cost(node, explained),
            Owner::Late(node) => self.blame_lateness(node, explained),
            Owner::Match(topic, node) => {
                let (name, other) = (self.node(node), self.topic(topic));
                let share = self.share(owner, explained);
                format!(
                    "the age arose as the {name} waits for {other}, to match{share}: what makes \
                     {other} come sooner helps"
                )
            }
            Owner::Crash(node) => {
                let name = self.node(node);
                let cure = self.mended_by(&format!("restart {name}"));
                format!("the {name} crashed: its last message stays in use. {cure}")
            }
            Owner::Clock(node) => {
                let (name, every) = (self.node(node), ms(explained.interval(node)));
                let cure = self.mended_by(&format!("clock {name} 0 0"));
                format!(
                    "the age arose in the {name}: by its wrong clock it ticks every {every}. {cure}"
                )
            }
            Owner::Phase(node) => {
                let cure = self.mended_by(&format!("offset {} 0", self.node(node)));
                format!("the age arose as messages wait for ticks. {cure}")
            }
            Owner::Link(topic) => {
                let name = self.topic(topic);
                let (loss, delay) = (explained.loss(topic) * 100.0, ms(explained.delay(topic)));
                let what = match (loss > 0.0, explained.delay(topic).is_zero()) {
                    (true, true) => format!("loses {loss:.0} % of the messages"),
                    (true, false) => format!("takes {delay} and loses {loss:.0} %"),
                    _ => format!("takes {delay}"),
                };
                let cure = self.mended_by(&format!("link {name} none"));
                format!("the age arose on {name}: its link {what}. {cure}")
            }
            Owner::Order(topic) => {
                let (name, depth) = (self.topic(topic), self.graph.topics[topic].depth);
                let cure = self.mended_by(&format!("read {name} newest"));
                format!(
                    "the age arose in the queue of {name}: it is read from the old end, {depth} \
                     deep. {cure}"
                )
            }
        }
    }

    fn blame_cost(&self, node: usize, explained: &Explained<'_>) -> String {
        let (name, every) = (self.node(node), ms(explained.interval(node)));
        let time = explained.time().as_secs_f64();
        let busy = (explained.busy(node).as_secs_f64() / time * 100.0).min(100.0);
        let none = format!("takes {name} none");
        let cure = match self.is_set_to_take(name) || self.was_turned(&none) {
            true => self.mended_by(&none),
            false => format!("a faster one {}", self.mends()),
        };
        format!(
            "the age arose in the {name}: its ticks take {busy:.0} % of the time and come every \
             {every}. {cure}"
        )
    }

    /// Whether a knob sets the duration of the ticks of `node`; without one they take the
    /// time that they need.
    fn is_set_to_take(&self, node: &str) -> bool {
        let mut knobs = self.setup.iter();
        let sets = |knob: &Knob| match knob {
            Knob::Takes { spec, .. } => !spec.draw.is_none(),
            knob => knob.kind() == KnobKind::Hang,
        };
        knobs.any(|knob| knob.target() == node && sets(knob))
    }

    /// Whether `knob` was turned since the start, and is in force.
    fn was_turned(&self, knob: &str) -> bool {
        let knob = knob.parse::<Knob>();
        knob.is_ok_and(|knob| self.turned.iter().any(|turned| *turned == knob))
    }

    /// Names `knob` as the cure; where keys turn knobs, with the key of the prompt.
    fn mended_by(&self, knob: &str) -> String {
        if self.was_turned(knob) {
            return format!("{knob} came too late");
        }
        let key = if self.live { ":" } else { "" };
        format!("{key}{knob} {}", self.mends())
    }

    /// What a cure does: limits of chains may need several of them.
    fn mends(&self) -> &'static str {
        match self.system.graph_file() {
            Some(_) => "lowers it",
            None => "mends it",
        }
    }

    /// Whether a higher rate of the node asks nothing for more than there is time for.
    fn has_time(&self, node: usize) -> bool {
        let node = &self.graph.nodes[node];
        let Ok(hz) = Hz::new(node.hz.get() * 1.25) else {
            return true;
        };
        let mut setup = self.system.settings();
        setup.extend(self.setup.iter().cloned());
        let now = self.system.warnings(&setup);
        let node = node.name.to_string();
        setup.extend([Knob::Rate { node, hz }]);
        self.system.warnings(&setup) == now
    }

    fn blame_rate(&self, node: usize, explained: &Explained<'_>) -> String {
        let name = self.node(node);
        let every = match self.graph.nodes[node].overruns {
            0 => explained.pace(node),
            _ => explained.interval(node),
        };
        let (setting, key) = rate_setting(self.system, name);
        let mut turned = self.turned.iter();
        let raised = turned.any(|knob| knob.kind() == KnobKind::Rate && knob.target() == name)
            && explained.pace(node) > self.graph.nodes[node].hz.period();
        let cure = match key.filter(|_| self.live) {
            _ if !self.has_time(node) => {
                "There is no time for a higher rate: lower the load first".to_owned()
            }
            _ if raised => format!("{setting} was raised too late"),
            Some(key) => format!("{key} raises {setting}"),
            None => format!("raise {setting}"),
        };
        let topics = self.graph.topics.iter();
        let reads = topics
            .clone()
            .any(|topic| topic.subscriptions.iter().any(|reader| reader.node == node));
        let mut outputs = topics
            .filter(|topic| topic.publishers.contains(&node) && !topic.subscriptions.is_empty());
        let arose = match (reads, outputs.next()) {
            (true, Some(topic)) => {
                format!("on {}: the {name} decides every {}", topic.name, ms(every))
            }
            (true, None) => format!("in the {name}: it acts every {}", ms(every)),
            (false, _) => {
                let times = (10.0 / every.as_secs_f64()).round() / 10.0;
                format!("at the {name}: it looks {times} times a second")
            }
        };
        format!("the age arose {arose}. {cure}")
    }

    /// The symptom at the queue of a slow node.
    fn symptom(&self, owner: Owner) -> Option<String> {
        let (Owner::Rate(node) | Owner::Cost(node)) = owner else {
            return None;
        };
        let mut topics = self.graph.topics.iter();
        let input = topics.find(|topic| topic.subscriptions.iter().any(|r| r.node == node))?;
        let input_period = input.publishers.iter();
        let input_period = input_period.map(|node| self.graph.nodes[*node].hz.period());
        let slower = input_period.min()? < self.graph.nodes[node].hz.period();
        match (input.dropped(), input.depth) {
            (0, 1) => None,
            (0, depth) => {
                slower.then(|| format!("a queue of {depth} drops nothing and changes nothing"))
            }
            (dropped, _) => Some(format!(
                "{dropped} dropped readings are harmless by themselves"
            )),
        }
    }

    fn node(&self, node: usize) -> &str {
        &self.graph.nodes[node].name
    }

    fn topic(&self, topic: usize) -> &str {
        &self.graph.topics[topic].name
    }
}

/// The owner of the largest part of an age; for a slow node, also the nodes that are
/// equally slow.
fn main_owners(explained: &Explained<'_>, acts: usize) -> Vec<Owner> {
    let owners = explained.owners(acts);
    let Some(&(first, _)) = owners.first() else {
        return crashed(explained).into_iter().collect();
    };
    let Owner::Rate(slowest) = first else {
        return vec![first];
    };
    let slow = explained.pace(slowest).mul_f64(AS_SLOW);
    let as_slow = |node: &usize| explained.pace(*node) >= slow;
    let path = upstream(explained.graph, acts).into_iter();
    let mut slow: Vec<Owner> = path.filter(as_slow).map(Owner::Rate).collect();
    if !slow.contains(&first) {
        slow.insert(0, first);
    }
    slow
}

/// A crashed node, if no action was ever applied.
fn crashed(explained: &Explained<'_>) -> Option<Owner> {
    let node = explained.graph.nodes.iter().position(|node| node.crashed);
    node.map(Owner::Crash)
}

/// The node of `graph` with a push age.
pub fn acting(system: &dyn System, graph: &Snapshot) -> Option<usize> {
    let (acts, _) = system.latency()?;
    graph.nodes.iter().position(|node| *node.name == *acts)
}

/// The last second of a run, or the last two periods of the slowest node on the path to
/// `acts` if those are longer; never before the first push.
pub fn latest(graph: &Snapshot, lineage: &Lineage, acts: usize) -> (Time, Time) {
    let path = upstream(graph, acts).into_iter();
    let periods = path.map(|node| graph.nodes[node].hz.period());
    let window = LATELY.max(periods.max().unwrap_or_default() * 2);
    let from = Time::ZERO + graph.now.since(Time::ZERO + window);
    (from.max(lineage.first_push(acts)), graph.now)
}

/// The nodes whose messages reach `last`, in the order in which they were added.
fn upstream(graph: &Snapshot, last: usize) -> Vec<usize> {
    let mut path = vec![last];
    let mut next = 0;
    while let Some(&reader) = path.get(next) {
        let read = |node: usize| {
            let topics = graph.topics.iter();
            topics.filter(move |topic| topic.subscriptions.iter().any(|r| r.node == node))
        };
        for topic in read(reader) {
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

/// The name of the rate of `node`, and the key that raises it.
fn rate_setting(system: &dyn System, node: &str) -> (String, Option<char>) {
    let aliases = system.aliases().iter();
    let mut rates = aliases
        .filter(|alias| alias.kind() == KnobKind::Rate)
        .enumerate();
    let alias = rates.find(|(_, alias)| alias.knobs == [(KnobKind::Rate, node)]);
    match alias {
        Some((number, alias)) => (alias.name.to_owned(), RATE_KEYS.get(number).copied()),
        None => (format!("rate {node}"), None),
    }
}

fn ms(duration: Duration) -> String {
    format!("{} ms", number(duration))
}

/// Rounds to whole milliseconds.
fn number(duration: Duration) -> String {
    format!("{:.0}", duration.as_secs_f64() * 1e3)
}

#[cfg(test)]
mod tests;
