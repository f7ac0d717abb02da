//! A graph file with some of its keys changed, as text.

use thiserror::Error;
use toml::{Table, Value};

use super::{ExecutorSpec, GraphFile};

/// A graph file with some of its keys changed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ChangedFile {
    /// Its text.
    pub text: String,
    /// The keys that went because of the change, such as `node.planner.match`, each with its value.
    pub left_out: Vec<String>,
}

/// A change that cannot be made.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ChangeError {
    /// Another language, in the file or in the change.
    #[error("{text:?} is not TOML: {why}")]
    Language {
        /// The text.
        text: String,
        /// What is wrong in it.
        why: String,
    },
    /// The file lacks this node.
    #[error("the file has no node {0:?}")]
    Node(String),
}

/// Returns the graph file in `text` with the keys of `change`, such as `node.planner.rate = 10`. A
/// trigger takes the place of a rate, and a rate that of a trigger, whose topics the node reads
/// then; keys that only the other one can have are left out.
///
/// # Errors
/// [`ChangeError`] for a text that is not TOML, and for a node that the file lacks.
pub fn changed(text: &str, change: &str) -> Result<ChangedFile, ChangeError> {
    let read = |text: &str| {
        let table = text.parse::<Table>();
        table.map_err(|error| ChangeError::Language {
            text: text.to_owned(),
            why: error.message().to_owned(),
        })
    };
    let (mut whole, change) = (read(text)?, read(change)?);
    let mut left_out = Vec::new();
    let nodes = change.get("node").and_then(Value::as_table);
    for (name, node) in nodes.into_iter().flatten() {
        let known = whole
            .get_mut("node")
            .and_then(|nodes| nodes.get_mut(name))
            .and_then(Value::as_table_mut)
            .ok_or_else(|| ChangeError::Node(name.clone()))?;
        left_out.extend(make_room(known, name, node));
    }
    for (name, limit) in change
        .get("limit")
        .and_then(Value::as_table)
        .into_iter()
        .flatten()
    {
        let known = whole
            .get_mut("limit")
            .and_then(|limits| limits.get_mut(name));
        if let (Some(known), Some(_)) = (known.and_then(Value::as_table_mut), limit.as_table()) {
            known.clear(); // A limit has one bound.
        }
    }
    merge(&mut whole, change);
    Ok(ChangedFile {
        text: whole.to_string(),
        left_out,
    })
}

/// Leaves out the keys of the node called `name` that it cannot have with those of `change`; returns
/// them.
fn make_room(node: &mut Table, name: &str, change: &Value) -> Vec<String> {
    let mut left_out = Vec::new();
    let others = node.remove("or");
    let others = others.iter().filter_map(Value::as_array).flatten();
    let others: Vec<Table> = others.map(keys_of).collect();
    let others: Vec<Value> = others
        .into_iter()
        .filter_map(|other| read_anew(node, other, change))
        .collect();
    if !others.is_empty() {
        node.insert("or".to_owned(), Value::Array(others));
    }
    let mut leave_out = |node: &mut Table, key: &str| {
        let value = node.remove(key)?;
        left_out.push(format!("node.{}.{key} = {value}", key_of(name)));
        Some(value)
    };
    match (
        change.get("trigger").and_then(Value::as_array),
        change.get("rate"),
    ) {
        (Some(triggers), None) => {
            for key in ["rate", "offset", "late", "only_new"] {
                leave_out(node, key);
            }
            // Such a file has the lateness of each tick of the timer.
            let wakes = node.get("wakes").and_then(Value::as_str);
            if wakes.is_some_and(|wakes| wakes.contains("file:")) {
                leave_out(node, "wakes");
            }
            if let Some(reads) = node.get_mut("reads").and_then(Value::as_array_mut) {
                reads.retain(|topic| !triggers.contains(topic));
            }
        }
        (None, Some(_)) => {
            for key in ["match", "every"] {
                leave_out(node, key);
            }
            if let Some(Value::Array(mut topics)) = leave_out(node, "trigger") {
                let reads = node.get("reads").and_then(Value::as_array);
                topics.extend(reads.into_iter().flatten().cloned());
                node.insert("reads".to_owned(), Value::Array(topics));
            }
        }
        _ => {}
    }
    left_out
}

/// Returns the `other` reading of `node` after `change`. If that changes what only the other
/// reading has, the node is as that has it: a rate is changed of a timer, a trigger takes the place
/// of one.
fn read_anew(node: &mut Table, mut other: Table, change: &Value) -> Option<Value> {
    let [to_rate, to_trigger] = ["rate", "trigger"].map(|key| change.get(key).is_some());
    let is_kind = other.contains_key("takes")
        && (other.contains_key("rate") || other.contains_key("trigger"));
    if is_kind && (to_rate || to_trigger) {
        if node.contains_key("trigger") && change.get("takes").is_none() {
            // Its costs as a timer lack the wait for a tick.
            other.retain(|key, _| key == "takes" || to_rate && key != "rate");
            let most = node.get("takes").map(|takes| format!("takes = {takes}"));
            node.extend(other);
            return most.map(Value::String);
        }
        return None;
    }
    if to_rate && other.contains_key("rate") {
        return None;
    }
    if to_trigger {
        other.retain(|key, _| key == "takes");
    }
    scale(&mut other, node.get("takes"), change.get("takes"));
    let keys = other.iter().map(|(key, value)| format!("{key} = {value}"));
    let keys: Vec<String> = keys.collect();
    (!keys.is_empty()).then(|| Value::String(keys.join(", ")))
}

/// Returns the keys of another reading.
fn keys_of(other: &Value) -> Table {
    let keys = format!("or = {{ {} }}", other.as_str().unwrap_or_default()).parse::<Table>();
    match keys.unwrap_or_default().remove("or") {
        Some(Value::Table(keys)) => keys,
        _ => Table::new(),
    }
}

/// Scales the costs of the `other` reading of a node whose costs change from `old` to a multiple.
fn scale(other: &mut Table, old: Option<&Value>, new: Option<&Value>) {
    let number = |value: &Value| match value {
        Value::Integer(whole) => Some(*whole as f64),
        value => value.as_float(),
    };
    let factor = |old: &Value, new: &Value| match (old.as_str(), new.as_str()) {
        (Some(old), Some(new)) => {
            let times = new.strip_suffix(old)?.trim().strip_suffix('*')?;
            times.trim().parse().ok()
        }
        _ => Some(number(new)? / number(old)?),
    };
    let factor: Option<f64> = old.zip(new).and_then(|(old, new)| factor(old, new));
    let Some((factor, costs)) = factor.zip(other.get_mut("takes")) else {
        return;
    };
    *costs = match (number(costs), &*costs) {
        (Some(ms), _) => Value::Float(ms * factor),
        (None, Value::String(text)) => Value::String(format!("{factor} * {text}")),
        (None, other) => other.clone(),
    };
}

/// The kinds of executors with callback groups that are tried.
const ROS_KINDS: [&str; 4] = ["single", "multi:2", "multi:4", "events"];

/// The matches that are tried where messages need no stamps, or have the same.
const QUEUES: [&str; 3] = ["each", "exact:10", "approximate:10"];

/// How many times the rate of the simulator's clock are tried in its place.
const CLOCKS: [f64; 3] = [2.0, 5.0, 10.0];

/// A change of a key of a graph file.
pub struct KeyChange {
    /// What it is about: a node, an executor or the clock.
    pub about: String,
    /// The key with its new value.
    pub with: String,
}

impl GraphFile {
    /// Returns what may be changed of a node beside its knobs: a trigger in place of its rate, how
    /// its triggers match, a thread of its own, another kind of executor, and that it goes first.
    pub fn changes_of(&self, name: &str) -> Vec<KeyChange> {
        let mut changes: Vec<String> = Vec::new();
        let (node, key) = (self.node(name), key_of(name));
        if let Some(node) = node {
            let topics = node.reads.iter().filter(|_| node.triggers.is_empty());
            changes.extend(topics.map(|topic| format!("node.{key}.trigger = [{:?}]", topic.text)));
            let matches = QUEUES.into_iter().filter(|_| node.triggers.len() > 1);
            changes.extend(matches.map(|matching| format!("node.{key}.match = {matching:?}")));
        }
        let executor = self.executor_of(name);
        if let Some(executor) = executor {
            let others = executor.nodes.iter().map(|node| &*node.text);
            let others: Vec<&str> = others.filter(|other| *other != name).collect();
            if !others.is_empty() {
                changes.push(format!(
                    "executor.{}.nodes = {others:?}",
                    key_of(&executor.name)
                ));
            }
            let first = executor.kind.to_string().starts_with("fixed-priority");
            changes.extend((first && node.is_some()).then(|| format!("node.{key}.priority = 0")));
        }
        let of_node = changes.into_iter().map(|with| KeyChange {
            about: name.to_owned(),
            with,
        });
        of_node
            .chain(executor.into_iter().flat_map(other_kinds))
            .collect()
    }

    /// Other rates of the simulator's clock, if the file has one.
    pub fn clock_changes(&self) -> impl Iterator<Item = KeyChange> {
        let hz = self.clock_hz.into_iter();
        hz.flat_map(|hz| CLOCKS.map(|times| times * hz))
            .map(|hz| KeyChange {
                about: "clock".to_owned(),
                with: format!("clock.rate = {hz}"),
            })
    }

    /// Returns whether `node` shares an executor with a node that is `named`.
    pub fn shares(&self, node: &str, named: impl Fn(&str) -> bool) -> bool {
        let executor = self.executor_of(node);
        executor.is_some_and(|executor| executor.nodes.iter().any(|node| named(&node.text)))
    }
}

/// Other kinds of an executor for the same nodes: of ROS, or with another core.
fn other_kinds(executor: &ExecutorSpec) -> impl Iterator<Item = KeyChange> {
    let known = executor.kind.to_string();
    let kinds: Vec<String> = match known.split_once(':') {
        _ if executor.kind.kind().has_groups => ROS_KINDS.map(str::to_owned).to_vec(),
        Some((kind, cores)) => {
            let more = cores.parse::<usize>().map_or(2, |cores| cores + 1);
            vec![format!("{kind}:{more}")]
        }
        None => Vec::new(),
    };
    let name = executor.name.clone();
    let others = kinds.into_iter().filter(move |kind| *kind != known);
    others.map(move |kind| KeyChange {
        about: name.clone(),
        with: format!("executor.{}.kind = {kind:?}", key_of(&name)),
    })
}

/// Returns `name` as a key of TOML: in quotes if it has dots or letters beyond ASCII.
pub fn key_of(name: &str) -> String {
    let is_bare = |c: char| c.is_ascii_alphanumeric() || "_-".contains(c);
    if name.chars().all(is_bare) {
        name.to_owned()
    } else {
        format!("{name:?}")
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

#[cfg(test)]
mod tests {
    use super::key_of;

    #[test]
    fn a_name_is_quoted_where_toml_would_read_another_key() {
        for (name, key) in [
            ("planner", "planner"),
            ("arm_2-left", "arm_2-left"),
            ("a.b", "\"a.b\""),
            ("bär", "\"bär\""),
        ] {
            assert_eq!(key_of(name), key);
        }
    }
}
