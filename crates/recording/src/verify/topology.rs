//! The graph that was recorded held against the one that its configuration makes.

use ratelab::{NodeTopology, Time, TopicTopology, Topology};

use super::difference::Difference;

/// Returns the first node or topic that is another one.
pub fn compare(recorded: &Topology, computed: &Topology) -> Option<Difference> {
    let nodes = [recorded, computed].map(|graph| graph.nodes.iter().map(node).collect());
    let topics = [recorded, computed].map(|graph| graph.topics.iter().map(topic).collect());
    let parts = pairs("node", nodes).chain(pairs("topic", topics));
    Difference::first(parts)
}

/// Returns what is recorded and what is computed, one after the other.
fn pairs(kind: &str, runs: [Vec<String>; 2]) -> impl Iterator<Item = Difference> {
    (0..runs[0].len().max(runs[1].len())).map(move |index| {
        let told = |items: &Vec<String>| items.get(index).map_or("none".to_owned(), String::clone);
        let what = format!("{kind} {index} of the graph");
        Difference::new(Time::ZERO, what, runs.each_ref().map(told))
    })
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
    let named = executor.as_ref();
    let executor = named.map_or(String::new(), |executor| format!(", executor {executor}"));
    let release = if triggers.is_empty() {
        format!("at {hz}")
    } else {
        format!("triggered by topics {triggers:?}")
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
