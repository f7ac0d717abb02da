//! The executors of a graph file, and the nodes that they run.

use ratelab::{Callback, Executor, ExecutorError, KnobKind, Release, TickTiming};

use super::{
    ExecutorSpec, GraphFile, NodeSpec,
    document::Block,
    error::{Checked, Placed, holds, name, node_of, once, refuse},
    format::NODES,
};

impl GraphFile {
    /// Returns the executor of `node`; `None` for a node on its own.
    pub(super) fn executor_of(&self, node: &str) -> Option<&ExecutorSpec> {
        self.executors
            .iter()
            .find(|executor| holds(&executor.nodes, node))
    }

    /// Returns the nodes without an executor, with a place for errors.
    fn without_executor(&self, at: usize) -> Vec<Placed> {
        self.names()
            .filter(|node| self.executor_of(node).is_none())
            .map(|node| Placed::new(node, at))
            .collect()
    }

    /// Returns the groups and deadlines of nodes whose executors have no use for them.
    pub(super) fn idle_settings(&self) -> Vec<String> {
        let placed = self
            .nodes
            .iter()
            .filter_map(|node| Some((node, self.executor_of(&node.name)?.kind)));
        let idle = placed.flat_map(|(node, kind)| {
            let callback = &node.callback;
            let group = !kind.kind().has_groups && callback.group_name().is_some();
            let deadline = !kind.kind().has_deadlines && callback.deadline().is_some();
            let name = &node.name;
            let group = group.then(|| {
                let of = "single, multi and events have";
                format!("group of {name} has no effect: executor {kind} has no groups; {of}")
            });
            let deadline = deadline.then(|| {
                format!("deadline_ms of {name} has no effect: executor {kind} has none; edf has")
            });
            group.into_iter().chain(deadline)
        });
        idle.collect()
    }

    /// Returns a node as its executor knows it; one of the system in the middle is known by its
    /// name.
    pub(super) fn callback(&self, node: &str) -> Callback {
        let known = self.node(node);
        known.map_or_else(|| Callback::new(node), |known| known.callback.clone())
    }
}

pub(super) fn executor(block: &Block, file: &GraphFile) -> Checked<ExecutorSpec> {
    name(&block.name)?;
    let Placed { text: name, at } = block.name.clone();
    let text = block.text("kind").unwrap_or(&block.name);
    let kind: Result<Executor, ExecutorError> = text.text.parse();
    let kind = kind.or_else(|error| refuse(text.at, format!("kind: {error}")))?;
    let listed = block.at("nodes");
    let nodes = match listed {
        Some(_) => block.list("nodes").to_vec(),
        None => file.without_executor(at),
    };
    if nodes.is_empty() {
        let why = match listed {
            Some(_) => format!("expected {}", NODES.expected()),
            None => "the executors before it have them all".to_owned(),
        };
        let what = format!("executor {name:?} has no nodes: {why}");
        return refuse(listed.unwrap_or(at), what);
    }
    for (index, node) in nodes.iter().enumerate() {
        once("nodes", node, &nodes[..index])?;
        member(node, kind, file)?;
    }
    Ok(ExecutorSpec { name, kind, nodes })
}

/// Checks a node of an executor of this kind.
fn member(node: &Placed, kind: Executor, file: &GraphFile) -> Checked {
    let name = &node.text;
    if let Some(other) = file.executor_of(name) {
        let what = format!("{name:?} has the executor {:?} already", other.name);
        return refuse(node.at, format!("{what}: leave one out"));
    }
    let Some(known) = node_of(file, node)? else {
        return Ok(());
    };
    let remedy = if kind.kind().has_deadlines {
        "a deadline_ms"
    } else {
        "a rate"
    };
    match known.release {
        Release::On(_) if kind.needs_period(&known.callback) => {
            let what = format!("messages trigger {name:?}, so it has no period for {kind}");
            refuse(node.at, format!("{what}: give it {remedy}"))
        }
        _ => Ok(()),
    }
}

/// Checks the settings of a node that only one with an executor has, or without.
pub(super) fn placement(block: &Block, node: &NodeSpec, file: &GraphFile) -> Checked {
    one_executor_of_group(block, node, file)?;
    let of_thread = KnobKind::ALL
        .into_iter()
        .filter(|kind| *kind == KnobKind::Late || kind.sets(TickTiming::Start));
    let (keys, why) = match file.executor_of(&node.name) {
        None => (vec!["group", "deadline_ms"], "is in no executor"),
        Some(_) => (
            of_thread.map(KnobKind::name).collect(),
            "has no thread of its own, only its executor",
        ),
    };
    let mut there = keys.iter().filter_map(|key| Some((key, block.at(key)?)));
    there.next().map_or(Ok(()), |(key, at)| {
        refuse(at, format!("{:?} {why}: leave {key} out", node.name))
    })
}

/// Refuses a group whose nodes are in several executors: it would exclude nothing.
fn one_executor_of_group(block: &Block, node: &NodeSpec, file: &GraphFile) -> Checked {
    let (group, at) = (node.callback.group_name(), block.at("group"));
    let (Some(group), Some(at)) = (group, at) else {
        return Ok(());
    };
    let executor = |node: &NodeSpec| file.executor_of(&node.name).map(|e| &e.name);
    let mut others = file.nodes.iter();
    let others = others.find(|other| {
        other.callback.group_name() == Some(group) && executor(other) != executor(node)
    });
    let place = |node: &NodeSpec| match executor(node) {
        Some(name) => format!("{:?} is in executor {name:?}", node.name),
        None => format!("{:?} is in no executor", node.name),
    };
    others.map_or(Ok(()), |other| {
        let places = [node, other].map(place).join(", but ");
        let what = format!("group: {places}, and both name group {group:?}");
        refuse(at, format!("{what}: choose another name for one of them"))
    })
}
