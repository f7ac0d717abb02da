//! The phases of nodes: when in its period each one is due.
//!
//! Nodes of a graph are due together at run time zero, and nodes with a common period ever after.
//! Of such a tie virtual time has one order. On threads the phases differ from start to start, so
//! the age of a run in virtual time is one of many.

use std::{cell::LazyCell, sync::Arc, thread, time::Duration};

use ratelab::{Chance, Draw, Knob, KnobKind, NodeTopology, TickTiming, Time, Topology, millis};
use ratelab_metrics::Lineage;

use super::{
    Config, Experiment, Summary,
    ages::BACKLOG,
    sweep::{SweepAxis, SweepValue},
};
use ratelab_system::DataChain;

/// Name of the axis of phases.
const PHASE: &str = "phase";

/// How long a run is at the most in which a tie is turned round.
const TRIED: Time = Time::from_nanos(5_000_000_000);

/// Periods of the slowest node in a run that is looked through for ties.
const PERIODS: u32 = 12;

/// Messages from which on a share of them counts.
const FEWEST: usize = 3;

/// The difference of two mean ages from which it is worth a note (ms).
const WORTH_MS: f64 = 1.0;

impl Experiment {
    /// Returns an axis of `count` settings of the phases, for a [`Sweep`](super::sweep::Sweep):
    /// each node that ticks at a rate is due somewhere in its first period. The draws are those of
    /// `SEED phase NODE N`, in whole microseconds.
    pub fn phases(&self, count: usize) -> SweepAxis {
        let topology = self.graph.topology();
        let nodes = topology.nodes.iter().filter(|node| self.can_shift(node));
        let nodes: Vec<_> = nodes.collect();
        let value = |number: usize| {
            let drawn = |node: &&NodeTopology| {
                let (seed, what, name) = (self.config.seed, "phase", node.name.as_str());
                let share = Chance { seed, what, name }.uniform(number as u64);
                let micros = node.hz.period().as_secs_f64() * 1e6 * share;
                offset(node, Duration::from_micros(micros as u64))
            };
            Arc::new(SweepValue {
                axis: PHASE.to_owned(),
                text: format!("p{number}"),
                knobs: nodes.iter().map(drawn).collect(),
            })
        };
        SweepAxis {
            name: PHASE.to_owned(),
            // Its values are names: no number with the unit of an offset.
            kind: KnobKind::Read,
            values: (0..count).map(value).collect(),
        }
    }

    fn can_shift(&self, node: &NodeTopology) -> bool {
        node.triggers.is_empty() && self.check(&offset(node, Duration::ZERO)).is_ok()
    }

    /// For each chain with nodes that read data at the very instant of their delivery, which keeps
    /// its data fresh: which ones, and how much older the data are if they come a little later.
    pub fn tie_notes(&self) -> Vec<String> {
        let topology = self.graph.topology();
        let chains = self.system.about().chains.iter();
        let hops = chains.map(|chain| (chain, self.hops(chain, &topology)));
        let hops: Vec<_> = hops.filter(|(_, hops)| !hops.is_empty()).collect();
        let nodes = hops
            .iter()
            .flat_map(|(_, hops)| hops)
            .flat_map(|hop| [hop.from, hop.reader]);
        let slowest = nodes.map(|node| topology.nodes[node].hz.period()).max();
        let long = slowest
            .filter(|_| !self.starts_programs())
            .map(|slowest| TRIED.min(Time::ZERO + slowest * PERIODS));
        let Some((_, lineage)) = long.and_then(|end| self.short_run(end, Vec::new())) else {
            return Vec::new();
        };
        let age = |chain: &DataChain, run: Option<&(Summary, Lineage)>| {
            let (run, _) = run?;
            chain.mean_ms(run.sim_time, &run.chains)
        };
        // One run for all chains that have ties.
        let unchanged = LazyCell::new(|| self.short_run(TRIED, Vec::new()));
        let notes = hops.iter().filter_map(|(chain, hops)| {
            let tied = hops.iter().filter(|hop| hop.is_tied(&lineage));
            let tied: Vec<&ChainHop> = tied.collect();
            let later = tied.first()?.from;
            let turned = chain.nodes.iter().rev().enumerate().filter_map(|(place, node)| self.late(node, place));
            let changed = self.short_run(TRIED, turned.collect());
            let older = age(chain, changed.as_ref())? - age(chain, (*unchanged).as_ref())?;
            let told = tied.iter().map(|hop| {
                let reader = &topology.nodes[hop.reader].name;
                format!("{reader} reads {}", topology.topics[hop.topic].name)
            });
            let told: Vec<String> = told.collect();
            let name = &topology.nodes[later].name;
            (older >= WORTH_MS).then(|| {
                format!(
                    "chain {}: {} at the very instant of delivery; where messages come a microsecond \
                     later the data are up to {} ms older, as they may be on the real clock: try \
                     --knob \"wakes {name} 0.2\"",
                    chain.name(),
                    told.join(" and "),
                    millis::text(older),
                )
            })
        });
        notes.collect()
    }

    /// Returns the steps of a chain from one node to another one that reads at moments of its own:
    /// not when the first one triggers it, nor in an executor, which has an order.
    fn hops(&self, chain: &DataChain, topology: &Topology) -> Vec<ChainHop> {
        let nodes = chain.nodes.iter().map(|name| topology.node(name));
        let nodes: Vec<usize> = nodes.flatten().collect();
        let hops = nodes
            .windows(2)
            .zip(chain.topics())
            .filter_map(|(nodes, topic)| {
                let &[from, reader] = nodes else {
                    return None;
                };
                let topic = topology.topic(topic)?;
                let triggers = &topology.nodes[reader].triggers;
                let mut triggers = triggers.iter().map(|topic| &topology.topics[*topic]);
                let triggered = triggers.any(|topic| topic.publishers.contains(&from));
                let executed = [from, reader].map(|node| &topology.nodes[node].executor);
                let is_free = !triggered && executed.iter().all(|executor| executor.is_none());
                let can_wait = self.late(&topology.nodes[from].name, 1).is_some();
                (is_free && can_wait).then_some(ChainHop {
                    from,
                    topic,
                    reader,
                })
            });
        hops.collect()
    }

    /// Returns a knob by which a node starts so many microseconds late; `None` for one that is not
    /// to.
    fn late(&self, node: &str, micros: usize) -> Option<Knob> {
        let is_late = self
            .config
            .setup
            .iter()
            .filter(|knob| knob.target() == node)
            .any(|knob| knob.kind().sets(TickTiming::Start));
        let late = Knob::Wakes {
            node: node.to_owned(),
            lateness: Draw::Constant(Duration::from_micros(micros as u64)),
        };
        (micros > 0 && !is_late && self.check(&late).is_ok()).then_some(late)
    }

    /// Returns a run up to `end` with these `knobs`, and its messages and ticks.
    fn short_run(&self, end: Time, knobs: Vec<Knob>) -> Option<(Summary, Lineage)> {
        let end = self.config.end.min(end);
        let mut config = Config {
            end,
            ..self.config.clone()
        };
        config.setup.extend(knobs);
        let run = Self::from_resolved(self.system.clone(), config).ok()?;
        let mut lineage = Lineage::new(run.observer().topology(), &[]);
        let tap = run.taps().heads(BACKLOG);
        let reader = thread::spawn(move || {
            tap.items()
                .iter()
                .flatten()
                .for_each(|row| lineage.add(row));
            lineage
        });
        let ended = run.run();
        Some((ended.ok()?, reader.join().ok()?))
    }

    /// Returns whether a run of it starts a process.
    fn starts_programs(&self) -> bool {
        self.config.setup.iter().any(|knob| match knob {
            Knob::Send { node, text } => self.system.knobs().is_program(node, text, true),
            _ => false,
        })
    }
}

/// A step of a chain: a node publishes to a topic, and another one reads it.
struct ChainHop {
    from: usize,
    topic: usize,
    reader: usize,
}

impl ChainHop {
    /// Returns whether nearly every message is read first at the instant of its delivery.
    fn is_tied(&self, lineage: &Lineage) -> bool {
        let reads = lineage.ticks(self.reader).filter_map(|worked| {
            let mut reads = worked.reads();
            let read = reads.find(|read| read.topic == self.topic)?;
            Some((read, worked.tick.at))
        });
        let (mut first, mut at_once, mut last) = (0, 0, None);
        for (read, at) in reads.filter(|(read, _)| last.replace(*read) != Some(*read)) {
            let arrives = lineage.head(read).and_then(|sent| sent.arrives);
            first += 1;
            at_once += usize::from(arrives == Some(at));
        }
        first >= FEWEST && at_once * 10 >= first * 9
    }
}

fn offset(node: &NodeTopology, offset: Duration) -> Knob {
    let node = node.name.clone();
    Knob::Offset { node, offset }
}
