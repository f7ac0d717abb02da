//! The ages of a run as sums of their parts, each with the node or topic that it is due to.

use std::thread::{self, JoinHandle};

use ratelab::{Time, TimeSpan, Topology};
use ratelab_metrics::{AgeOverTime, AgeStage, Lineage, NodeAccount, Observer};
use ratelab_system::{Setup, System};

use crate::Taps;

/// Number of lots of messages and ticks that may wait to be counted.
pub(super) const BACKLOG: usize = 16;

/// Number of messages and ticks after which their ages are counted.
const BATCH: usize = 4_096;

/// Messages and ticks kept per topic and node.
const KEPT: usize = 1 << 14;

/// By how much two means of one age may differ (ns): what a run measures is in milliseconds, as a
/// double.
const ROUNDING: u64 = 1_000;

/// An age of a run, over run time: that of the data at the end of a chain, or of the push.
#[derive(Clone, Debug, PartialEq)]
pub struct RunAge {
    /// The chain; `None` for the push.
    pub chain: Option<String>,
    /// The node at its end.
    pub node: String,
    /// The node that began the data, where there are data of several behind the push.
    pub source: Option<String>,
    /// Whether it stands beside the age of the same push by the data of an earlier source, which is the
    /// one that the run measures.
    pub is_beside: bool,
    /// Its mean (ns).
    pub mean_ns: i64,
    /// What it does not exceed for 99 % of the time (ns), to the microsecond.
    pub p99_ns: i64,
    /// The means of its parts, the largest first: they sum to its mean.
    pub parts: Vec<AgeShare>,
    /// The mean that the run itself measured (ns), where its parts sum to another one: then they are
    /// left out.
    pub apart_from_ns: Option<i64>,
}

/// A part of an age.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AgeShare {
    /// What it is; of stages with one name the first.
    pub stage: AgeStage,
    /// The node or topic that it is due to; empty for one before what is known.
    pub owner: String,
    /// Its mean over run time (ns).
    pub ns: i64,
}

/// The ages of a run while it is read.
pub struct RunAges {
    lineage: Lineage,
    ways: Vec<AgeWay>,
}

/// The age at the end of one way of the data.
struct AgeWay {
    chain: Option<String>,
    node: usize,
    /// The node that began the data; `None` for the first one that did.
    source: Option<usize>,
    topics: Vec<String>,
    until: Time,
    ages: AgeOverTime,
}

impl RunAges {
    /// Creates the ages of a run of `system` with an empty `lineage`, or one with all of it.
    pub fn new(system: &dyn System, lineage: Lineage) -> Self {
        let chains = system.about().chains;
        // One of a single node reads nothing.
        let ends = chains.iter().filter(|chain| !chain.topics().is_empty());
        // The push of a graph without a system in it is that of its first chain.
        let acts = system.latency().filter(|(node, meter)| {
            let mut chains = chains.iter();
            !chains.any(|chain| (chain.last(), chain.name()) == (*node, *meter))
        });
        let topology = lineage.topology();
        let pushes: Vec<usize> = match acts {
            Some((node, _)) => topology.node(node).into_iter().collect(),
            // A graph of the library does not say who acts: all nodes that push.
            None if chains.is_empty() => (0..topology.nodes.len()).collect(),
            None => Vec::new(),
        };
        let ends = ends.filter_map(|chain| {
            Some(AgeWay {
                chain: Some(chain.name().to_owned()),
                topics: chain.topics().to_vec(),
                ..AgeWay::for_push(topology.node(chain.last())?, None)
            })
        });
        let sources: Vec<usize> = match acts {
            None if lineage.sources().count() > 1 => lineage.sources().collect(),
            _ => Vec::new(),
        };
        let ways = pushes
            .iter()
            .flat_map(|node| {
                let sources = sources.iter().map(|source| Some(*source));
                [None]
                    .into_iter()
                    .chain(sources)
                    .map(|source| AgeWay::for_push(*node, source))
            })
            .chain(ends);
        Self {
            ways: ways.collect(),
            lineage,
        }
    }

    /// Counts each way up to its last tick; to the end of a run that is over.
    fn advance(&mut self, end: Option<RunEnd>) {
        let Self { lineage, ways } = self;
        for way in ways {
            // Each node of a graph of the library might act.
            if way.chain.is_none() && !lineage.acts_on_the_world(way.node) {
                continue;
            }
            match way.source {
                Some(source) => lineage.go_from(source),
                None if !lineage.go_along(&way.topics) => continue,
                None => {}
            }
            let until = match (end, &way.chain) {
                (None, _) => last_end(lineage, way.node),
                (Some(run), Some(_)) => Some(run.chains),
                (Some(run), None) => last_sensing(lineage, way.node).max(Some(run.at)),
            };
            let until = until.unwrap_or(way.until);
            let span = TimeSpan::new(way.until, until);
            way.ages.extend(lineage, way.node, span);
            way.until = way.until.max(until);
        }
    }

    /// Returns the ages of the run, which ended at run time `end` with these `nodes`; those that
    /// nothing tells are left out.
    pub fn finish(mut self, end: Time, nodes: &[NodeAccount]) -> Vec<RunAge> {
        let chains = self.ways.iter().filter(|way| way.chain.is_some());
        let chains = chains
            .filter_map(|way| last_end(&self.lineage, way.node))
            .chain([end])
            .max()
            .unwrap_or(end);
        self.advance(Some(RunEnd { at: end, chains }));
        let topology = self.lineage.topology();
        let pushed = |node: usize| {
            let name = &*topology.nodes[node].name;
            nodes
                .iter()
                .filter(|node| node.push_age.saw().is_some())
                .any(|node| *node.name == *name)
        };
        let ways = self
            .ways
            .iter()
            .filter(|way| way.chain.is_some() || pushed(way.node));
        let mut ages: Vec<RunAge> = Vec::new();
        for age in ways.filter_map(|way| way.age(topology)) {
            match ages.last_mut() {
                // The data of the first source are the data of the push itself.
                Some(push) if age.is_beside && push.source.is_none() => push.source = age.source,
                _ => ages.push(age),
            }
        }
        for place in 0..ages.len() {
            let next = ages.get(place + 1);
            let is_one_of_several = ages[place].is_beside || next.is_some_and(|age| age.is_beside);
            if !is_one_of_several {
                ages[place].source = None;
            }
        }
        ages
    }
}

/// The end of a run. On the real clock a tick may end a little later: what comes last counts, as in the
/// figures of the run.
#[derive(Clone, Copy)]
struct RunEnd {
    /// Run time.
    at: Time,
    /// That of the newest output of a chain, if it is later.
    chains: Time,
}

/// Returns the end of the last tick of a node that ended.
fn last_end(lineage: &Lineage, node: usize) -> Option<Time> {
    lineage
        .ticks(node)
        .rev()
        .find_map(|worked| worked.tick.ends)
}

/// Returns when a node acted first by the sensing of its last action: to there, or to the end of
/// the run, the run measures the age of what it does.
fn last_sensing(lineage: &Lineage, node: usize) -> Option<Time> {
    let mut pushes = lineage
        .ticks(node)
        .rev()
        .filter_map(|worked| worked.tick.push);
    let last = pushes.next()?;
    Some(
        pushes
            .take_while(|push| push.sensed == last.sensed)
            .last()
            .unwrap_or(last)
            .at,
    )
}

impl AgeShare {
    /// Returns whether it has this name in tables, and this owner.
    pub fn is(&self, key: &str, owner: &str) -> bool {
        self.stage.key() == key && self.owner == owner
    }
}

impl RunAge {
    /// Returns the name of its chain, or `push`.
    pub fn name(&self) -> &str {
        self.chain.as_deref().unwrap_or("push")
    }

    /// Returns whether no part is below zero, as one is after the error of a clock: then the parts
    /// are shares of a whole. A thousandth is no such error: on the real clock a node may read a
    /// message that came after its tick began.
    pub fn has_shares(&self) -> bool {
        let least = -self.mean_ns.abs() / 1000;
        self.parts.iter().all(|part| part.ns >= least)
    }

    /// This age, without its parts if they do not sum to the mean that the run `measured` (ms): that
    /// counts an age below zero as zero.
    #[must_use]
    pub(super) fn checked(self, measured: Option<f64>) -> Self {
        let measured = measured
            .filter(|_| self.has_shares())
            .map(|ms| (ms * 1e6).round() as i64);
        match measured.filter(|ns| ns.abs_diff(self.mean_ns) > ROUNDING) {
            Some(ns) => Self {
                parts: Vec::new(),
                apart_from_ns: Some(ns),
                ..self
            },
            None => self,
        }
    }
}

impl AgeWay {
    /// That of the push of a node, with data from the node `source`.
    fn for_push(node: usize, source: Option<usize>) -> Self {
        Self {
            chain: None,
            node,
            source,
            topics: Vec::new(),
            until: Time::ZERO,
            ages: AgeOverTime::default(),
        }
    }

    fn age(&self, topology: &Topology) -> Option<RunAge> {
        let mut parts: Vec<AgeShare> = Vec::new();
        for (stage, ns) in self.ages.parts() {
            let owner = stage.owner(topology);
            let mut known = parts.iter_mut();
            match known.find(|part| part.is(stage.key(), owner)) {
                Some(part) => part.ns += ns,
                None => parts.push(AgeShare {
                    stage,
                    owner: owner.to_owned(),
                    ns,
                }),
            }
        }
        parts.sort_by_key(|part| std::cmp::Reverse(part.ns));
        Some(RunAge {
            chain: self.chain.clone(),
            node: topology.nodes[self.node].name.clone(),
            source: (self.source).map(|source| topology.nodes[source].name.clone()),
            is_beside: self.source.is_some(),
            mean_ns: self.ages.mean_ns()?,
            p99_ns: self.ages.quantile(0.99)?,
            parts,
            apart_from_ns: None,
        })
    }
}

/// Adds up the ages of a running experiment, on a thread of its own.
pub(super) struct AgeWatch(JoinHandle<Option<RunAges>>);

impl AgeWatch {
    /// From the beginning of the run to its end.
    pub(super) fn start(system: &dyn System, setup: &Setup, taps: &Taps, run: Observer) -> Self {
        let tap = taps.heads(BACKLOG);
        let lineage = Lineage::new(run.topology(), setup.iter()).keeping(KEPT);
        let mut ages = RunAges::new(system, lineage);
        Self(thread::spawn(move || {
            let (mut rows, mut events) = (0, 0);
            let mut events_until_now = |ages: &mut RunAges| {
                let new = run.events(events);
                events += new.len();
                new.iter().for_each(|event| ages.lineage.event(event));
            };
            for lot in tap.items() {
                rows += lot.len();
                lot.into_iter().for_each(|row| ages.lineage.add(row));
                if rows >= BATCH {
                    rows = 0;
                    events_until_now(&mut ages);
                    ages.advance(None);
                }
            }
            events_until_now(&mut ages);
            (tap.lost() == 0).then_some(ages)
        }))
    }

    /// Waits for the end of the run, as [`RunAges::finish`]; no ages if rows came too fast.
    pub(super) fn finish(self, end: Time, nodes: &[NodeAccount]) -> Vec<RunAge> {
        let ages = self.0.join().ok().flatten();
        ages.map_or_else(Vec::new, |ages| ages.finish(end, nodes))
    }
}
