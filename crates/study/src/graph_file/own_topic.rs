//! The topics of a graph file.

use super::GraphFile;
use crate::system::{ForwardingNode, kept_list};

/// A topic of a graph file, with the chains through it.
pub(super) struct OwnTopic {
    pub(super) name: String,
    pub(super) chains: Vec<usize>,
    /// Names of the numbers in its messages.
    pub(super) fields: &'static [&'static str],
}

/// The topics that the nodes of `file` publish, but for those behind a topic of a system.
pub(super) fn own_topics(file: &GraphFile, relays: &[ForwardingNode]) -> Vec<OwnTopic> {
    let mut topics: Vec<OwnTopic> = Vec::new();
    for topic in file.nodes.iter().flat_map(|node| &node.publishes) {
        let known = topics.iter().any(|known| known.name == topic.text);
        if known || relays.iter().any(|relay| relay.to == topic.text) {
            continue;
        }
        let chains = file.chains.iter().enumerate();
        let through = chains.filter(|(_, chain)| chain.place(&topic.text).is_some());
        let (chains, names): (Vec<_>, Vec<_>) = through
            .map(|(index, spec)| (index, format!("{} origin (ns)", spec.chain.name)))
            .unzip();
        topics.push(OwnTopic {
            name: topic.text.clone(),
            fields: match chains.is_empty() {
                true => &["origin (ns)"],
                false => kept_list(names),
            },
            chains,
        });
    }
    topics
}
