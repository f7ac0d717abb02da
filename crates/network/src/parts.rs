//! Which nodes of a graph make a process.

use ratelab::Topology;
use ratelab_system::System;

/// Returns the nodes that `names` stand for: nodes, or groups of them.
pub fn nodes(system: &dyn System, graph: &Topology, names: &[String]) -> Vec<String> {
    let groups = system.groups();
    let mut nodes: Vec<String> = Vec::new();
    for name in names {
        let group = groups.iter().find(|group| group.name == *name);
        let members = group.map_or(vec![name.clone()], |group| {
            graph
                .nodes
                .iter()
                .map(|node| &node.name)
                .filter(|name| group.nodes.contains(name))
                .cloned()
                .collect()
        });
        for member in members {
            add(&mut nodes, member);
        }
    }
    nodes
}

/// Returns the names under which all nodes run apart, as far as they can.
pub fn apart(system: &dyn System, graph: &Topology) -> Vec<String> {
    let groups = system.groups();
    let mut parts: Vec<String> = Vec::new();
    for node in &graph.nodes {
        let group = groups.iter().find(|group| group.nodes.contains(&node.name));
        let name = group.map_or(&node.name, |group| &group.name);
        add(&mut parts, name.clone());
    }
    parts
}

fn add(names: &mut Vec<String>, name: String) {
    if !names.contains(&name) {
        names.push(name);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ratelab_cart_pole::CartPole;
    use ratelab_experiment::{Config, Experiment};
    use std::sync::Arc;

    #[test]
    fn the_plant_is_a_part_and_so_is_every_other_node() {
        let system = Arc::new(CartPole::default());
        let experiment = Experiment::new(system.clone(), &Config::default()).expect("cart-pole");
        let graph = experiment.observer().topology();
        assert_eq!(apart(&*system, &graph), ["plant", "policy"]);
        let named = |name: &str| nodes(&*system, &graph, &[name.to_owned()]);
        assert_eq!(named("plant"), ["sensor", "actuator"]);
        assert_eq!(named("policy"), ["policy"]);
        assert_eq!(named("nobody"), ["nobody"]);
    }
}
