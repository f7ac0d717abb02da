//! The nodes of a graph file between a topic of a system and its reader.

use ratelab::Topology;

use super::{
    ChainSpec, GraphFile, InnerSpec, NodeSpec,
    document::Placed,
    error::{GraphFileError, instead},
};
use crate::system::{ForwardingNode, Setup, Surroundings, System};

/// Checks the graph of `file` around `system`; returns the nodes between a topic of the system
/// and its reader, and the graph of the system.
pub(super) fn insert(
    file: &GraphFile,
    inner: &InnerSpec,
    system: &dyn System,
) -> Result<(Vec<ForwardingNode>, Topology), GraphFileError> {
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
        if let Some(topic) = node.inputs().find(|topic| !exists(topic)) {
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
    check_executors(file, &topology)?;
    check_topics(file, &topology)?;
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
    for chain in &file.chains {
        check_chain(file, chain, &topology, &relays)?;
    }
    Ok((relays, topology))
}

/// Checks that the nodes of executors are nodes of the file or of the system.
fn check_executors(file: &GraphFile, topology: &Topology) -> Result<(), GraphFileError> {
    let names = || {
        let own = file.nodes.iter().map(|node| node.name.as_str());
        own.chain(topology.nodes.iter().map(|node| node.name.as_str()))
    };
    let mut nodes = file.executors.iter().flat_map(|executor| &executor.nodes);
    let Some(unknown) = nodes.find(|node| !names().any(|name| name == node.text)) else {
        return Ok(());
    };
    let what = format!(
        "no node {:?}: {}",
        unknown.text,
        instead(&unknown.text, names())
    );
    Err(GraphFileError::at(&file.text, unknown.at, what))
}

/// Checks that the topics with settings are topics of the file or of the system.
fn check_topics(file: &GraphFile, topology: &Topology) -> Result<(), GraphFileError> {
    let names = || {
        let own = file.nodes.iter().flat_map(|node| &node.publishes);
        let own = own.map(|topic| topic.text.as_str());
        own.chain(topology.topics.iter().map(|topic| topic.name.as_str()))
    };
    let mut topics = file.topics.iter();
    let Some(unknown) = topics.find(|topic| !names().any(|name| name == topic.text)) else {
        return Ok(());
    };
    let what = format!(
        "no topic {:?}: {}",
        unknown.text,
        instead(&unknown.text, names())
    );
    Err(GraphFileError::at(&file.text, unknown.at, what))
}

/// Checks the path of a chain where it goes through nodes of the system, whose messages carry
/// only the time of the sensing behind them.
fn check_chain(
    file: &GraphFile,
    chain: &ChainSpec,
    topology: &Topology,
    relays: &[ForwardingNode],
) -> Result<(), GraphFileError> {
    let refuse = |at: &Placed, what: String| Err(GraphFileError::at(&file.text, at.at, what));
    let is_relay = |name: &str| relays.iter().any(|relay| relay.node == name);
    let (first, last) = (&chain.path[0], chain.last());
    let number = |name: &str| topology.nodes.iter().position(|node| node.name == name);
    let reads = |node: usize| {
        let mut topics = topology.topics.iter();
        topics.any(|topic| topic.readers.contains(&node))
    };
    if is_relay(&first.text) || number(&first.text).is_some_and(reads) {
        let what = format!(
            "the data of {} are older than its tick: begin {} at the node that senses them",
            first.text, chain.name
        );
        return refuse(first, what);
    }
    if number(last).is_some() || is_relay(last) {
        let what = format!(
            "{} ends at {last}, a node of the system or before one: expected another node of this \
             file; the system measures the ages of its own actions",
            chain.name
        );
        return refuse(first, what);
    }
    for step in chain.path.windows(2) {
        let [from, to] = [&step[0], &step[1]];
        let reading = from.text.starts_with('/');
        let (node, topic) = if reading { (to, from) } else { (from, to) };
        if file.nodes.iter().any(|known| known.name == node.text) {
            continue;
        }
        let mut topics = topology.topics.iter();
        let topic = topics.find(|known| known.name == topic.text);
        let joined = number(&node.text).zip(topic).is_some_and(|(node, topic)| {
            let ends = if reading {
                &topic.readers
            } else {
                &topic.publishers
            };
            ends.contains(&node)
        });
        if !joined {
            return refuse(to, format!("no way from {} to {}", from.text, to.text));
        }
    }
    Ok(())
}

/// The nodes on the way from the topic `from` of a system to the topic `to`, in the order of
/// the data.
fn line(
    file: &GraphFile,
    from: &Placed,
    to: &Placed,
) -> Result<Vec<ForwardingNode>, GraphFileError> {
    let mut relays: Vec<ForwardingNode> = Vec::new();
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
        let inputs: Vec<&Placed> = node.inputs().collect();
        let ([input], [_]) = (&inputs[..], &node.publishes[..]) else {
            return refuse(format!(
                "{} is between {:?} and its reader: expected a node that reads one topic and \
                 publishes one",
                node.name, from.text
            ));
        };
        if node.priority.is_some() {
            let (name, from) = (&node.name, &from.text);
            let what = format!("{name} ticks right behind the publisher of {from:?}");
            return refuse(format!("{what}: leave its priority out"));
        }
        if relays.iter().any(|relay| relay.node == node.name) {
            return refuse(format!(
                "{:?} is no way from {:?}: a circle",
                to.text, from.text
            ));
        }
        relays.push(ForwardingNode {
            node: node.name.clone(),
            release: node.release.clone(),
            from: input.text.clone(),
            to: topic,
        });
        topic = input.text.clone();
    }
    relays.reverse();
    Ok(relays)
}
