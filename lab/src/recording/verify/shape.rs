//! The graph that was recorded held against the one that its configuration makes.

use ratelab::runtime::{
    Time,
    telemetry::{NodeShape, Shape, TopicShape},
};

use super::difference::Difference;

/// The first node or topic that is another one.
pub fn compare(recorded: &Shape, computed: &Shape) -> Option<Difference> {
    let nodes = |shape: &Shape| shape.nodes.iter().map(node).collect::<Vec<_>>();
    let topics = |shape: &Shape| shape.topics.iter().map(topic).collect::<Vec<_>>();
    first("node", &nodes(recorded), &nodes(computed))
        .or_else(|| first("topic", &topics(recorded), &topics(computed)))
}

fn node(node: &NodeShape) -> String {
    let NodeShape {
        name,
        priority,
        hz,
        meters,
    } = node;
    format!("{name} at {hz}, priority {priority}, meters {meters:?}")
}

fn topic(topic: &TopicShape) -> String {
    let TopicShape {
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
