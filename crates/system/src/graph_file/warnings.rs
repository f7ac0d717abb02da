//! Warnings that are known before a run: nodes, callback groups and executors that are asked for
//! more than they can do, and clocks that keep a node silent, or that are too coarse for its rate.

use std::{collections::BTreeMap, time::Duration};

use ratelab::{ClockError, Hz, Knob, Time, Topology, millis};

use super::{ExecutorSpec, GraphSystem};
use crate::{Builder, FULL, Setup, System, WorldKind, cost_of, overload, shortest_ms};

/// The load of each node, by its name.
type Loads<'a> = BTreeMap<&'a str, Load>;

/// The load of a node.
#[derive(Clone, Copy, Debug)]
struct Load {
    /// Its rate, unless messages trigger it.
    rate: Option<Hz>,
    /// Ticks per second.
    hz: f64,
    /// The mean time that a tick takes (s).
    cost: f64,
}

impl Load {
    /// Returns the share of a core that it needs.
    fn share(self) -> f64 {
        self.hz * self.cost
    }
}

impl GraphSystem {
    /// Returns the overloads of a run with `setup`.
    pub(super) fn overloads(&self, setup: &Setup) -> Vec<String> {
        let loads = self.loads(setup);
        let nodes = self.topology().nodes.iter().map(|node| &*node.name);
        let alone = nodes
            .filter(|name| self.file.node(name).is_none())
            .chain(self.file.names())
            .filter(|node| self.has_core(node))
            .filter_map(|node| {
                let load = loads.get(node)?;
                match load.rate {
                    Some(hz) => overload(node, hz, setup),
                    None => swamped(node, *load),
                }
            });
        let executors = self
            .file
            .executors
            .iter()
            .filter_map(|executor| self.overload_of(executor, &loads));
        alone.chain(executors).collect()
    }

    /// Returns whether a node has a core of its own.
    fn has_core(&self, node: &str) -> bool {
        let executor = self.file.executor_of(node);
        executor.is_none_or(|executor| executor.kind.shares().is_none())
    }

    /// Returns its graph, as far as it can be built: what refuses it is told where it is to run.
    pub(super) fn topology(&self) -> &Topology {
        self.topology.get_or_init(|| {
            let setup = Setup::default();
            let mut builder = Builder::new(0, &setup, WorldKind::Course);
            let _ = self.build(&mut builder);
            builder.graph.topology()
        })
    }

    /// Returns the loads of all nodes with `setup`. Messages are taken to arrive at the rates of
    /// the nodes that publish them.
    fn loads(&self, setup: &Setup) -> Loads<'_> {
        let topology = self.topology();
        let rate = |node: usize| {
            let node = &topology.nodes[node];
            setup.rate(&node.name).unwrap_or(node.hz)
        };
        let loads = topology
            .nodes
            .iter()
            .zip(topology.ticks_per_second(rate))
            .enumerate()
            .map(|(index, (node, hz))| {
                let load = Load {
                    rate: node.triggers.is_empty().then(|| rate(index)),
                    hz,
                    cost: cost_of(setup, &node.name)
                        .mean_of(|took| took.as_secs_f64())
                        .unwrap_or_default(),
                };
                (&*node.name, load)
            });
        loads.collect()
    }

    fn overload_of(&self, executor: &ExecutorSpec, loads: &Loads<'_>) -> Option<String> {
        let (name, kind) = (&executor.name, executor.kind);
        let threads = kind.shares()?;
        let share = |node: &str| loads.get(node).map_or(0.0, |load| load.share());
        let total: f64 = executor.nodes.iter().map(|node| share(&node.text)).sum();
        if total > FULL * threads as f64 {
            return Some(format!(
                "executor {name} is overloaded: its nodes need {:.0} % of a \
                 core, and it has {} %, so they wait, skip periods or lose messages",
                total * 1e2,
                threads * 100
            ));
        }
        let mut groups: BTreeMap<String, f64> = BTreeMap::new();
        for node in &executor.nodes {
            *groups.entry(self.group(&node.text)).or_default() += share(&node.text);
        }
        let (group, total) = groups.into_iter().find(|(_, total)| *total > FULL)?;
        Some(format!(
            "{group} of executor {name} is overloaded: it needs {:.0} % of a \
             core and ticks on one at a time, so its ticks wait, skip periods or lose messages",
            total * 1e2
        ))
    }

    /// Returns the callback group of a node, or else the node itself.
    fn group(&self, node: &str) -> String {
        let known = self.file.node(node);
        let group = known.and_then(|known| known.callback.group_name());
        group.map_or_else(|| node.to_owned(), |group| format!("group {group}"))
    }
}

/// Returns a node that gets messages faster than it has done with them.
fn swamped(name: &str, load: Load) -> Option<String> {
    let (ms, share) = (shortest_ms(load.cost), load.share());
    (share > FULL).then(|| {
        format!(
            "{name} is overloaded: {ms} ms at {} Hz is {:.0} % of its time, so \
             messages will wait and be dropped",
            load.hz,
            share * 1e2
        )
    })
}

/// How late a first tick is from which on it is worth a note, beyond the offset of its node.
const LATE: Duration = Duration::from_secs(1);

impl GraphSystem {
    /// Returns what the clocks of a run with `setup` do to nodes at a rate.
    pub(super) fn clock_warnings(&self, setup: &Setup) -> Vec<String> {
        let warnings = self
            .topology()
            .nodes
            .iter()
            .filter(|node| node.triggers.is_empty())
            .filter_map(|node| {
                let error = setup
                    .iter()
                    .filter(|knob| knob.target() == node.name)
                    .find_map(|knob| match knob {
                        Knob::Clock { error, .. } => Some(*error),
                        _ => None,
                    })?;
                let offset = setup.offset(&node.name).unwrap_or_default();
                let hz = setup.rate(&node.name).unwrap_or(node.hz);
                silent(&node.name, error, offset).or_else(|| coarse(&node.name, error, hz))
            });
        warnings.collect()
    }
}

/// Returns a node whose clock shows the due time of the first tick long after the run has begun.
fn silent(node: &str, error: ClockError, offset: Duration) -> Option<String> {
    let due = Time::ZERO + offset;
    let first = error.when(due);
    (first > due + LATE).then(|| {
        let late = (first.as_secs_f64() * 10.0).round() / 10.0;
        format!(
            "{node} ticks first at {late:.1} s: its clock ({error}) shows {:.1} s then, when its \
             first tick is due",
            due.as_secs_f64()
        )
    })
}

/// Returns a node at a rate above that of the steps of its clock.
fn coarse(node: &str, error: ClockError, hz: Hz) -> Option<String> {
    let (step, period) = (error.step().as_secs_f64(), 1.0 / hz.get());
    (step > period * FULL).then(|| {
        format!(
            "{node} ticks at {hz}, but its clock goes in steps of {} ms, so it will skip {:.0} % of \
             its periods: raise the rate of the clock",
            millis::to_millis(error.step()),
            (1.0 - period / step) * 1e2
        )
    })
}
