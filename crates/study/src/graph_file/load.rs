//! Overloads that are known before a run: nodes, callback groups and executors that are asked
//! for more than they can do.

use std::collections::BTreeMap;

use ratelab::{Release, Topology};

use super::{ExecutorSpec, GraphSystem};
use crate::system::{FULL, Setup, cost_of, overload};

/// Ticks per second and the time that one of them takes, of each node by its name.
type Loads<'a> = BTreeMap<&'a str, Load>;

/// The load of a node.
#[derive(Clone, Copy, Debug, Default)]
struct Load {
    /// Ticks per second.
    hz: f64,
    /// The mean time that a tick takes (s).
    cost: f64,
}

impl Load {
    /// The share of a core that it needs.
    fn share(self) -> f64 {
        self.hz * self.cost
    }
}

impl GraphSystem {
    /// The overloads of a run with `setup`.
    pub(super) fn overloads(&self, setup: &Setup) -> Vec<String> {
        let loads = self.loads(setup);
        let inner = self.middle.iter().flat_map(|middle| &middle.topology.nodes);
        let inner = inner.map(|node| (&node.name, Some(node.hz)));
        let own = self.file.nodes.iter();
        let own = own.map(|node| match node.release {
            Release::Every(hz) => (&node.name, Some(hz)),
            Release::On(_) => (&node.name, None),
        });
        let alone = inner.chain(own).filter(|(node, _)| self.has_core(node));
        let alone = alone.filter_map(|(node, hz)| match hz {
            Some(hz) => overload(node, setup.rate(node).unwrap_or(hz), setup),
            None => swamped(node, loads[node.as_str()]),
        });
        let executors = self.file.executors.iter();
        let executors = executors.filter_map(|executor| self.overload_of(executor, &loads));
        alone.chain(executors).collect()
    }

    /// Whether a node has a core of its own.
    fn has_core(&self, node: &str) -> bool {
        let executor = self.file.executor_of(node);
        executor.is_none_or(|executor| executor.kind.shares().is_none())
    }

    /// The loads of all nodes with `setup`. Messages are taken to arrive at the rates of the
    /// nodes that publish them.
    fn loads(&self, setup: &Setup) -> Loads<'_> {
        let load = |name: &str, hz: f64| Load {
            hz,
            cost: cost_of(setup, name).mean_of(|took| took.as_secs_f64()),
        };
        let mut loads = Loads::new();
        for node in self.middle.iter().flat_map(|middle| &middle.topology.nodes) {
            let hz = setup.rate(&node.name).unwrap_or(node.hz);
            loads.insert(&node.name, load(&node.name, hz.get()));
        }
        let order = self.file.trigger_order().unwrap_or_default();
        for node in order.into_iter().map(|node| &self.file.nodes[node]) {
            let hz = match node.release {
                Release::Every(hz) => setup.rate(&node.name).unwrap_or(hz).get(),
                Release::On(_) => {
                    let topics = node.triggers.iter();
                    let rates = topics.map(|topic| self.messages_per_second(&topic.text, &loads));
                    rates.fold(f64::INFINITY, f64::min)
                }
            };
            loads.insert(&node.name, load(&node.name, hz));
        }
        loads
    }

    fn messages_per_second(&self, topic: &str, loads: &Loads<'_>) -> f64 {
        let own = self.file.nodes.iter();
        let own = own.filter(|node| node.publishes(topic));
        let own = own.map(|node| node.name.as_str());
        let inner = self.middle.iter().flat_map(|middle| {
            let Topology { nodes, topics } = &middle.topology;
            let topics = topics.iter().filter(|known| known.name == topic);
            let publishers = topics.flat_map(|topic| &topic.publishers);
            publishers.map(|node| nodes[*node].name.as_str())
        });
        let publishers = own.chain(inner);
        let rates = publishers.filter_map(|name| Some(loads.get(name)?.hz));
        rates.sum()
    }

    fn overload_of(&self, executor: &ExecutorSpec, loads: &Loads<'_>) -> Option<String> {
        let (name, kind) = (&executor.name, executor.kind);
        let threads = kind.shares()?;
        let share = |node: &str| loads.get(node).map_or(0.0, |load| load.share());
        let total: f64 = executor.nodes.iter().map(|node| share(&node.text)).sum();
        if total > FULL * threads as f64 {
            return Some(format!(
                "executor {name} is asked for more than it can do: its nodes need {:.0} % of a \
                 core, and {kind} has {} %, so they wait, skip periods or lose messages",
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
            "{group} of executor {name} is asked for more than it can do: it needs {:.0} % of a \
             core and ticks on one at a time, so its ticks wait, skip periods or lose messages",
            total * 1e2
        ))
    }

    /// The callback group of a node, or else the node itself.
    fn group(&self, node: &str) -> String {
        let known = self.file.node(node);
        let group = known.and_then(|known| known.callback.group_name());
        group.map_or_else(|| node.to_owned(), |group| format!("group {group}"))
    }
}

/// A node that gets messages faster than it has done with them.
fn swamped(name: &str, load: Load) -> Option<String> {
    let (ms, share) = ((load.cost * 1e4).round() / 10.0, load.share());
    (share > FULL).then(|| {
        format!(
            "{name} is asked for more than it can do: {ms} ms at {} Hz is {:.0} % of its time, so \
             messages will wait and be dropped",
            load.hz,
            share * 1e2
        )
    })
}
