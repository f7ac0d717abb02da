//! A graph file with some of its keys changed, as text.

use toml::{Table, Value};

use super::GraphFile;

/// The text of a graph file with the keys of `change`, such as `node.planner.rate = 10`. A trigger
/// stands in place of a rate.
///
/// # Errors
/// What is no TOML in one of them, or the node that the file lacks.
pub fn changed(text: &str, change: &str) -> Result<String, String> {
    let read = |text: &str| {
        let table = text.parse::<Table>();
        table.map_err(|error| format!("{text:?} is no TOML: {}", error.message()))
    };
    let (mut whole, change) = (read(text)?, read(change)?);
    let nodes = change.get("node").and_then(Value::as_table);
    for (name, node) in nodes.into_iter().flatten() {
        let known = whole.get_mut("node").and_then(|nodes| nodes.get_mut(name));
        let known = known.and_then(Value::as_table_mut);
        let known = known.ok_or_else(|| format!("the file has no node {name:?}"))?;
        if let Some(triggers) = node.get("trigger").and_then(Value::as_array) {
            known.remove("rate");
            known.remove("offset");
            if let Some(reads) = known.get_mut("reads").and_then(Value::as_array_mut) {
                reads.retain(|topic| !triggers.contains(topic));
            }
        }
    }
    merge(&mut whole, change);
    Ok(whole.to_string())
}

impl GraphFile {
    /// What may be changed of a node beside its knobs: a trigger in place of its rate, a thread of
    /// its own, and that it goes first.
    pub(crate) fn changes_of(&self, name: &str) -> Vec<String> {
        let node = self.node(name);
        let timed = node.filter(|node| node.triggers.is_empty());
        let topics = timed.into_iter().flat_map(|node| &node.reads);
        let triggers = topics.map(|topic| format!("node.{name}.trigger = [{:?}]", topic.text));
        let mut changes: Vec<String> = triggers.collect();
        if let Some(executor) = self.executor_of(name) {
            let others = executor.nodes.iter().map(|node| &*node.text);
            let others: Vec<&str> = others.filter(|other| *other != name).collect();
            if !others.is_empty() {
                changes.push(format!("executor.{}.nodes = {others:?}", executor.name));
            }
            let first = executor.kind.to_string().starts_with("fixed-priority");
            changes.extend((first && node.is_some()).then(|| format!("node.{name}.priority = 0")));
        }
        changes
    }
}

/// Sets the keys of `change`, in tables one by one.
fn merge(whole: &mut Table, change: Table) {
    for (key, value) in change {
        match (whole.get_mut(&key), value) {
            (Some(Value::Table(known)), Value::Table(change)) => merge(known, change),
            (_, value) => drop(whole.insert(key, value)),
        }
    }
}
