//! The executors of a graph file, and the nodes that they run.

use ratelab::Release;
use ratelab_effects::{Callback, Executor};

use super::{
    ExecutorSpec, GraphFile, NodeSpec,
    check::Checker,
    document::{Block, Placed},
    error::{GraphFileError, instead},
    format::Form,
};

impl GraphFile {
    /// The executor of `node`, if it has one.
    pub(super) fn executor_of(&self, node: &str) -> Option<&ExecutorSpec> {
        let mut executors = self.executors.iter();
        executors.find(|executor| executor.nodes.iter().any(|known| known.text == node))
    }

    /// The nodes without an executor, with a place for errors.
    fn without_executor(&self, at: usize) -> Vec<Placed> {
        let nodes = self.nodes.iter().map(|node| node.name.clone());
        let rest = nodes.filter(|node| self.executor_of(node).is_none());
        rest.map(|text| Placed { text, at }).collect()
    }

    /// The groups and deadlines of nodes whose executors have no use for them.
    pub(super) fn idle_settings(&self) -> Vec<String> {
        let nodes = self.nodes.iter();
        let placed = nodes.filter_map(|node| Some((node, self.executor_of(&node.name)?.kind)));
        let idle = placed.flat_map(|(node, kind)| {
            let callback = &node.callback;
            let group = !has_groups(kind) && callback.group_name().is_some();
            let deadline = !matches!(kind, Executor::Edf { .. }) && callback.deadline().is_some();
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

    /// A node as its executor knows it; one of the system in the middle is known by its name.
    pub(super) fn callback(&self, node: &str) -> Callback {
        let known = self.nodes.iter().find(|known| known.name == node);
        known.map_or_else(|| Callback::of(node), |known| known.callback.clone())
    }
}

fn has_groups(kind: Executor) -> bool {
    matches!(
        kind,
        Executor::Single | Executor::Multi { .. } | Executor::Events
    )
}

impl Checker<'_> {
    pub(super) fn executor(
        &self,
        block: &Block,
        file: &GraphFile,
    ) -> Result<ExecutorSpec, GraphFileError> {
        self.name(&block.name)?;
        let kind = block.text("kind").unwrap_or_else(|| block.name.clone());
        let parsed: Result<Executor, String> = kind.text.parse();
        let executor = ExecutorSpec {
            name: block.name.text.clone(),
            kind: parsed.map_err(|error| self.refuse(kind.at, format!("kind: {error}")))?,
            nodes: match block.at("nodes") {
                Some(_) => block.list("nodes"),
                None => file.without_executor(block.name.at),
            },
        };
        if executor.nodes.is_empty() {
            let (at, why) = match block.at("nodes") {
                Some(at) => (at, format!("expected {}", Form::Nodes.expected())),
                None => (
                    block.name.at,
                    "the executors before it have them all".to_owned(),
                ),
            };
            let what = format!("executor {:?} has no nodes: {why}", executor.name);
            return Err(self.refuse(at, what));
        }
        for (index, node) in executor.nodes.iter().enumerate() {
            let before = &executor.nodes[..index];
            if before.iter().any(|known| known.text == node.text) {
                let what = format!("nodes: {:?} is there twice: leave one out", node.text);
                return Err(self.refuse(node.at, what));
            }
            self.member(node, &executor, file)?;
        }
        Ok(executor)
    }

    /// Checks a node of an executor; one of the system in the middle is checked when that is
    /// known.
    fn member(
        &self,
        node: &Placed,
        executor: &ExecutorSpec,
        file: &GraphFile,
    ) -> Result<(), GraphFileError> {
        let name = &node.text;
        if let Some(other) = file.executor_of(name) {
            let what = format!(
                "{name:?} has the executor {:?} already: leave one out",
                other.name
            );
            return Err(self.refuse(node.at, what));
        }
        let Some(known) = file.nodes.iter().find(|known| known.name == *name) else {
            if file.inner.is_some() {
                return Ok(());
            }
            let instead = instead(name, file.nodes.iter().map(|node| &*node.name));
            return Err(self.refuse(node.at, format!("no node {name:?}: {instead}")));
        };
        let kind = executor.kind;
        let remedy = match kind {
            Executor::Let => "a rate",
            Executor::Edf { .. } if known.callback.deadline().is_none() => "a deadline_ms",
            _ => return Ok(()),
        };
        match known.release {
            Release::Every(_) => Ok(()),
            Release::On(_) => {
                let what = format!("messages trigger {name:?}, so it has no period for {kind}");
                Err(self.refuse(node.at, format!("{what}: give it {remedy}")))
            }
        }
    }

    /// Refuses a group whose nodes are in several executors: it would exclude nothing.
    fn one_executor_of_group(
        &self,
        block: &Block,
        node: &NodeSpec,
        file: &GraphFile,
    ) -> Result<(), GraphFileError> {
        let (group, at) = (node.callback.group_name(), block.at("group"));
        let (Some(group), Some(at)) = (group, at) else {
            return Ok(());
        };
        let executor = |node: &NodeSpec| file.executor_of(&node.name).map(|e| &e.name);
        let mut others = file.nodes.iter();
        let others = others.find(|other| {
            other.callback.group_name() == Some(group) && executor(other) != executor(node)
        });
        others.map_or(Ok(()), |other| {
            let what = format!("group: {:?} is in {group:?} too, but", other.name);
            Err(self.refuse(
                at,
                format!("{what} in another executor: choose another name"),
            ))
        })
    }

    /// Checks the settings of a node that only one with an executor has, or without.
    pub(super) fn placement(
        &self,
        block: &Block,
        node: &NodeSpec,
        file: &GraphFile,
    ) -> Result<(), GraphFileError> {
        let name = &node.name;
        let refuse = |keys: &[&str], why: &str| {
            let mut there = keys.iter().filter_map(|key| Some((key, block.at(key)?)));
            there.next().map_or(Ok(()), |(key, at)| {
                Err(self.refuse(at, format!("{name:?} {why}: leave {key} out")))
            })
        };
        self.one_executor_of_group(block, node, file)?;
        match file.executor_of(name) {
            None => refuse(&["group", "deadline_ms"], "is in no executor"),
            Some(_) => refuse(&["wakes"], "has no thread of its own, only its executor"),
        }
    }
}
