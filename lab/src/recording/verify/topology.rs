//! The graph that was recorded held against the one that its configuration makes.

use ratelab::{NodeTopology, Time, TopicTopology, Topology};

use super::difference::Difference;

/// The first node or topic that is another one.
pub fn compare(recorded: &Topology, computed: &Topology) -> Option<Difference> {
    let nodes = |topology: &Topology| topology.nodes.iter().map(node).collect::<Vec<_>>();
    let topics = |topology: &Topology| topology.topics.iter().map(topic).collect::<Vec<_>>();
    first("node", &nodes(recorded), &nodes(computed))
        .or_else(|| first("topic", &topics(recorded), &topics(computed)))
}

fn node(node: &NodeTopology) -> String {
    let NodeTopology {
        name,
        priority,
        hz,
        triggers,
        executor,
        // Recordings of before have none of these.
        matching: _,
        executor_index: _,
        group: _,
        meters,
    } = node;
    let executor = executor.as_ref();
    let executor = executor.map_or(String::new(), |executor| format!(", executor {executor}"));
    let release = match triggers.is_empty() {
        true => format!("at {hz}"),
        false => format!("triggered by topics {triggers:?}"),
    };
    format!("{name} {release}{executor}, priority {priority}, meters {meters:?}")
}

fn topic(topic: &TopicTopology) -> String {
    let TopicTopology {
        name,
        depth,
        publishers,
        readers,
    } = topic;
    format!("{name} depth {depth}, published by nodes {publishers:?}, read by {readers:?}")
}

fn first(kind: &str, recorded: &[String], computed: &[String]) -> Option<Difference> {
    let mut indices = 0..recorded.len().max(computed.len());
    let index = indices.find(|&index| recorded.get(index) != computed.get(index))?;
    let told = |items: &[String]| items.get(index).map_or("none".to_owned(), String::clone);
    Some(Difference {
        at: Time::ZERO,
        what: format!("{kind} {index} of the graph"),
        recorded: told(recorded),
        computed: told(computed),
    })
}
