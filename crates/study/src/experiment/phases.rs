//! The phases of nodes: when in its period each one is due.
//!
//! Nodes of a graph are due together at run time zero, and those with a common period ever after.
//! Of such a tie virtual time has one order. On threads the phases differ from start to start, so
//! the age of a run in virtual time is one of many.

use std::{sync::Arc, time::Duration};

use ratelab::{Knob, KnobKind, NodeTopology, TickTiming, Time, hyper_period, millis};
use ratelab_effects::Chance;

use super::{
    Config, Experiment,
    sweep::{SweepAxis, SweepValue},
};
use crate::system::{DataChain, cost_of};

/// Name of the axis of phases.
const PHASE: &str = "phase";

/// How long a run is at the most in which a tie is turned round.
const TRIED: Time = Time::from_nanos(5_000_000_000);

/// By how much a node is later than the next one of its chain, in a tie that is turned round.
const TURNED: Duration = Duration::from_micros(1);

/// The difference of two mean ages from which it is worth a note (ms).
const WORTH_MS: f64 = 1.0;

impl Experiment {
    /// An axis of `count` settings of the phases, for a [`Sweep`](super::sweep::Sweep): each node
    /// that ticks at a rate is due somewhere in its first period. The draws are those of
    /// `SEED phase NODE N`, in whole microseconds.
    pub fn phases(&self, count: usize) -> SweepAxis {
        let nodes = self.graph.topology().nodes;
        let nodes = nodes.iter().filter(|node| self.can_shift(node));
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

    fn offset(&self, node: &NodeTopology) -> Duration {
        self.config.setup.offset(&node.name).unwrap_or_default()
    }

    fn can_shift(&self, node: &NodeTopology) -> bool {
        node.triggers.is_empty() && self.check(&offset(node, Duration::ZERO)).is_ok()
    }

    /// For each chain with nodes that tie in an order which keeps its data fresh: what ties, and
    /// how much older the data are if each tie goes the other way, by a short run of each.
    pub fn tie_notes(&self) -> Vec<String> {
        let topology = self.graph.topology();
        let nodes = &topology.nodes;
        let mut chains = self.system.about().chains.iter();
        let notes = chains.by_ref().filter_map(|chain| {
            let path = chain.nodes.iter().map(|name| topology.node(name));
            let path: Vec<usize> = path.collect::<Option<_>>()?;
            let hops = path.windows(2);
            let tied = hops.filter(|hop| hop[0] < nodes.len() && self.ties(nodes, hop));
            let tied: Vec<String> = tied
                .map(|hop| format!("{} before {}", nodes[hop[0]].name, nodes[hop[1]].name))
                .collect();
            if tied.is_empty() || self.starts_programs() {
                return None;
            }
            let turned = path.iter().rev().enumerate().map(|(place, node)| {
                let node = &nodes[*node];
                let later = TURNED * u32::try_from(place).unwrap_or(u32::MAX);
                offset(node, self.offset(node) + later)
            });
            let [usual, other] = [Vec::new(), turned.collect()];
            let older = self.chain_age(chain, other)? - self.chain_age(chain, usual)?;
            (older >= WORTH_MS).then(|| {
                format!(
                    "chain {}: {}, at each tick, as virtual time orders ties; the other way round its data \
                     are up to {} ms older, as they may be on the real clock; --phases 20 tries \
                     other phases",
                    chain.name,
                    tied.join(" and "),
                    millis::text(older),
                )
            })
        });
        notes.collect()
    }

    /// Whether the second of two nodes reads at each of its ticks, or at each of the first one's,
    /// what the first one has just published.
    fn ties(&self, nodes: &[NodeTopology], hop: &[usize]) -> bool {
        let [from, to] = [&nodes[hop[0]], &nodes[hop[1]]];
        let setup = &self.config.setup;
        let is_free = |node: &&NodeTopology| {
            let mut knobs = setup.iter().filter(|knob| knob.target() == node.name);
            let is_late = knobs.any(|knob| knob.kind().sets(TickTiming::Start));
            node.executor.is_none() && self.can_shift(node) && !is_late
        };
        let [one, other] = [from, to].map(|node| node.hz.period().as_nanos());
        let [first, second] = [from, to].map(|node| self.offset(node).as_nanos());
        let common = hyper_period([from.hz, to.hz]).as_nanos();
        [from, to].iter().all(is_free)
            && cost_of(setup, &from.name).is_none()
            && (from.priority, hop[0]) < (to.priority, hop[1])
            && common == one.max(other)
            && first.abs_diff(second).is_multiple_of(one.min(other))
    }

    /// Whether a run of it starts a process.
    fn starts_programs(&self) -> bool {
        self.config.setup.iter().any(|knob| match knob {
            Knob::Send { node, text } => self.system.is_program(node, text, true),
            _ => false,
        })
    }

    /// The mean data age of `chain` in a short run with these `knobs` (ms).
    fn chain_age(&self, chain: &DataChain, knobs: Vec<Knob>) -> Option<f64> {
        let mut config = Config {
            end: self.config.end.min(TRIED),
            ..self.config.clone()
        };
        config.setup.extend(knobs);
        let run = Self::of_resolved(self.system.clone(), config).ok()?;
        let ended = run.run().ok()?;
        chain.mean_ms(ended.sim_time, &ended.chains)
    }
}

fn offset(node: &NodeTopology, offset: Duration) -> Knob {
    let node = node.name.clone();
    Knob::Offset { node, offset }
}
