//! Circles of nodes that trigger each other, or wait for each other for ever.
//!
//! A node publishes nothing before it has read something: a node at a rate waits for the first
//! message on any of its topics, a node that messages trigger for a message on each of its triggers.
//! So the nodes that can publish are found step by step: those that read nothing, then those whose
//! wait ends by what these publish, and so on. All others never publish, and some of them wait for
//! each other in a circle.

use super::{GraphFile, NodeSpec, error::Placed};

/// A node of a circle, and the topic by which it waits for the node before it.
type Waiting<'f> = (&'f Placed, usize);

impl GraphFile {
    /// Returns a topic between nodes that trigger each other in a circle, and their names, if there
    /// are such nodes.
    pub(super) fn trigger_circle(&self) -> Option<(&Placed, String)> {
        let mut rest: Vec<usize> = (0..self.nodes.len()).collect();
        while !rest.is_empty() {
            let trigger = |node: usize| self.waiting(self.nodes[node].triggers.iter(), &rest);
            let triggered = rest.iter().copied();
            let triggered: Vec<usize> = triggered.filter(|of| trigger(*of).is_some()).collect();
            if triggered.len() == rest.len() {
                let circle = circle(rest[0], trigger);
                let (topic, last) = *circle.last()?;
                let nodes = circle.iter().map(|(_, node)| *node);
                let names = [last]
                    .into_iter()
                    .chain(nodes)
                    .map(|node| self.name_of(node));
                return Some((topic, names.collect::<Vec<_>>().join(" → ")));
            }
            rest = triggered;
        }
        None
    }

    /// Returns a warning for each circle of nodes that wait for each other's first message for
    /// ever.
    pub(super) fn dead_circles(&self) -> Vec<String> {
        let silent = self.never_publish();
        let mut named: Vec<usize> = Vec::new();
        let mut warnings = Vec::new();
        for node in &silent {
            let circle = circle(*node, |node| {
                let topics = awaited(&self.nodes[node]);
                let silent_topics = topics.filter(|topic| self.is_silent(topic, &silent));
                self.waiting(silent_topics, &silent)
            });
            if circle.iter().all(|(_, node)| !named.contains(node)) {
                warnings.extend(self.dead_circle(&circle));
                named.extend(circle.iter().map(|(_, node)| *node));
            }
        }
        warnings
    }

    /// Returns what is wrong with the nodes of a circle, and what helps.
    fn dead_circle(&self, circle: &[Waiting<'_>]) -> Option<String> {
        let (topic, last) = circle.last()?;
        let last = self.name_of(*last);
        if circle.len() == 1 {
            let topic = &topic.text;
            return Some(format!(
                "{last} never publishes: before its first message it waits for one on {topic}, \
                 which only {last} publishes; let another node publish it"
            ));
        }
        let steps = circle.iter();
        let steps =
            steps.map(|(topic, node)| format!(" → {} → {}", topic.text, self.name_of(*node)));
        Some(format!(
            "{last}{}: each of these nodes waits for the first message of the one before it, so none \
             ever publishes; split one into a node that publishes and a node that reads",
            steps.collect::<String>()
        ))
    }

    fn name_of(&self, node: usize) -> &str {
        &self.nodes[node].name
    }

    /// Returns the nodes that can never publish, in the order of the file.
    fn never_publish(&self) -> Vec<usize> {
        let mut silent: Vec<usize> = (0..self.nodes.len()).collect();
        loop {
            let stays = |node: &usize| {
                let node = &self.nodes[*node];
                let mut topics = awaited(node).map(|topic| self.is_silent(topic, &silent));
                if node.triggers.is_empty() {
                    !node.reads.is_empty() && topics.all(|is_silent| is_silent)
                } else {
                    topics.any(|is_silent| is_silent)
                }
            };
            let rest: Vec<usize> = silent.iter().copied().filter(stays).collect();
            if rest.len() == silent.len() {
                return silent;
            }
            silent = rest;
        }
    }

    /// Returns whether only nodes of `silent` publish `topic`; a topic without a publisher in the
    /// file is one of the system in the middle.
    fn is_silent(&self, topic: &Placed, silent: &[usize]) -> bool {
        let mut publishers = self
            .nodes
            .iter()
            .enumerate()
            .filter(|(_, node)| node.publishes(&topic.text))
            .map(|(index, _)| index)
            .peekable();
        publishers.peek().is_some() && publishers.all(|publisher| silent.contains(&publisher))
    }

    /// Returns the first of `topics` that one of `nodes` publishes, and that node.
    fn waiting<'f>(
        &self,
        mut topics: impl Iterator<Item = &'f Placed>,
        nodes: &[usize],
    ) -> Option<Waiting<'f>> {
        topics.find_map(|topic| {
            let mut nodes = nodes.iter().copied();
            let publisher = nodes.find(|node| self.nodes[*node].publishes(&topic.text))?;
            Some((topic, publisher))
        })
    }
}

/// Returns the topics that `node` waits for before its first message: all triggers, or any other
/// topic.
fn awaited(node: &NodeSpec) -> impl Iterator<Item = &Placed> {
    let reads = node.reads.iter().filter(|_| node.triggers.is_empty());
    node.triggers.iter().chain(reads)
}

/// Returns the circle that `from` leads to, in the direction of the data; `waiting` returns the
/// topic that a node waits for, and its publisher. Empty if a node of the way waits for nothing.
fn circle<'f>(from: usize, waiting: impl Fn(usize) -> Option<Waiting<'f>>) -> Vec<Waiting<'f>> {
    let mut way: Vec<Waiting<'f>> = Vec::new();
    let mut node = from;
    while let Some((topic, publisher)) = waiting(node) {
        if let Some(begin) = way.iter().position(|(_, known)| *known == node) {
            way.drain(..begin);
            way.reverse();
            return way;
        }
        way.push((topic, node));
        node = publisher;
    }
    Vec::new()
}
