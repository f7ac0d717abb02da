//! The nodes of a graph file between a topic of a system and its reader.

use super::{
    GraphFile, InnerSpec, NodeSpec,
    document::Placed,
    error::{GraphFileError, instead},
};
use crate::{
    runtime::telemetry::Topology,
    system::{Relay, Setup, Surroundings, System},
};

/// What a graph file has to know of the system in its middle.
pub(super) struct Surrounded {
    pub(super) topology: Topology,
    pub(super) relays: Vec<Relay>,
}

/// Checks the graph of `file` around `system`.
pub(super) fn around(
    file: &GraphFile,
    inner: &InnerSpec,
    system: &dyn System,
) -> Result<Surrounded, GraphFileError> {
    let refuse = |at: &Placed, what: String| Err(GraphFileError::at(&file.text, at.at, what));
    let surroundings = match Surroundings::of(system, &Setup::default()) {
        Ok(surroundings) => surroundings,
        Err(error) => return refuse(&inner.name, error.to_string()),
    };
    let Surroundings {
        topology,
        recorded,
        offered,
    } = surroundings;
    let topics = topology.topics.iter().map(|topic| topic.name.as_str());
    for node in &file.nodes {
        if topology.nodes.iter().any(|known| known.name == node.name) {
            let name = &node.name;
            let what = format!("the system has a node {name:?} already: choose another name");
            return Err(GraphFileError::at(&file.text, node.at, what));
        }
        let taken = |topic: &&Placed| topics.clone().any(|known| known == topic.text);
        if let Some(topic) = node.publishes.iter().find(taken) {
            let name = &topic.text;
            let what = format!("{name:?} is a topic of the system: choose another name");
            return refuse(topic, what);
        }
        let exists = |topic: &&Placed| {
            let mut published = file.nodes.iter().flat_map(|node| &node.publishes);
            recorded.contains(&topic.text) || published.any(|known| known.text == topic.text)
        };
        if let Some(topic) = node.reads.iter().find(|topic| !exists(topic)) {
            let published = file.nodes.iter().flat_map(|node| &node.publishes);
            let known = published.map(|topic| topic.text.as_str());
            let known = known.chain(recorded.iter().map(String::as_str));
            let instead = instead(&topic.text, known);
            return refuse(
                topic,
                format!("no node publishes {:?}: {instead}", topic.text),
            );
        }
    }
    let mut relays = Vec::new();
    for (from, to) in &inner.remap {
        if !offered.contains(&from.text) {
            let instead = instead(&from.text, offered.iter().map(String::as_str));
            let what = format!(
                "{:?} has no reader that can be remapped: {instead}",
                from.text
            );
            return refuse(from, what);
        }
        relays.extend(line(file, from, to)?);
    }
    Ok(Surrounded { topology, relays })
}

/// The nodes on the way from the topic `from` of a system to the topic `to`, in the order of
/// the data.
fn line(file: &GraphFile, from: &Placed, to: &Placed) -> Result<Vec<Relay>, GraphFileError> {
    let mut relays: Vec<Relay> = Vec::new();
    let mut topic = to.text.clone();
    while topic != from.text {
        let refuse = |what: String| Err(GraphFileError::at(&file.text, to.at, what));
        let publishes = |node: &&NodeSpec| node.publishes.iter().any(|known| known.text == topic);
        let publishers: Vec<&NodeSpec> = file.nodes.iter().filter(publishes).collect();
        let [node] = publishers[..] else {
            let count = publishers.len();
            let way = format!("{:?} is no way from {:?}", to.text, from.text);
            return refuse(format!(
                "{way}: {count} nodes publish {topic:?}, expected one"
            ));
        };
        let ([input], [_]) = (&node.reads[..], &node.publishes[..]) else {
            return refuse(format!(
                "{} is between {:?} and its reader: expected a node that reads one topic and \
                 publishes one",
                node.name, from.text
            ));
        };
        if relays.iter().any(|relay| relay.node == node.name) {
            return refuse(format!(
                "{:?} is no way from {:?}: a circle",
                to.text, from.text
            ));
        }
        relays.push(Relay {
            node: node.name.clone(),
            hz: node.hz.get(),
            from: input.text.clone(),
            to: topic,
        });
        topic = input.text.clone();
    }
    relays.reverse();
    Ok(relays)
}
