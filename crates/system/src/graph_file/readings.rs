//! What a bag leaves open of a graph with a change: other readings of its nodes, new phases, longer
//! queues.

use toml::{Table, Value};

/// A graph as the bag behind it may be read as well.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BagReading {
    /// What is read in another way, such as `planner is a timer`.
    pub what: String,
    /// The keys of the graph file that say so, for `--with`.
    pub with: Vec<String>,
    /// Whether nodes at a new rate have another phase in it.
    pub is_phase: bool,
}

/// The parts of a period by which nodes at a new rate are shifted. Two rates that lock repeat their
/// phases after a part of a period: these are apart in the first six such parts, too.
const PHASES: [f64; 4] = [0.17, 0.28, 0.38, 0.74];

/// A queue that no bag has shown to be full.
const LONG: u32 = 10;

/// Returns the other readings of the graph file with the text `now`, which had the text `before` as
/// it came from its bag.
pub fn readings(before: &str, now: &str) -> Vec<BagReading> {
    let [before, now] = [before, now].map(|text| text.parse::<Table>().unwrap_or_default());
    let others = nodes(&now).flat_map(|(name, node)| {
        others(node).map(move |keys| BagReading {
            what: format!("{name} {}", OtherKind::from_keys(keys).words()),
            with: vec![format!("node.{name:?} = {{ {keys} }}")],
            is_phase: false,
        })
    });
    let mut all: Vec<BagReading> = others.collect();
    let moved: Vec<(&String, f64, f64)> = nodes(&now)
        .filter_map(|(name, node)| {
            let rate = node.get("rate")?;
            let hz = number(rate)?;
            let is_new = key(&before, "node", name, "rate") != Some(rate);
            let offset = node.get("offset").and_then(number).unwrap_or(0.0);
            is_new.then_some((name, 1e3 / hz, offset))
        })
        .collect();
    let phases = PHASES.iter().filter(|_| !moved.is_empty());
    all.extend(phases.map(|part| {
        let offset = |(name, period, offset): &(&String, f64, f64)| {
            format!("node.{name:?}.offset = {:.6}", offset + part * period)
        };
        BagReading {
            what: format!("the phase is {part} periods later"),
            with: moved.iter().map(offset).collect(),
            is_phase: true,
        }
    }));
    let queues = nodes(&now).filter(|(name, node)| {
        let was_triggered = key(&before, "node", name, "trigger").is_some();
        was_triggered && !node.contains_key("match")
    });
    let topics = queues.filter_map(|(_, node)| node.get("trigger")?.as_array());
    let with: Vec<String> = topics
        .flatten()
        .filter_map(Value::as_str)
        .filter(|topic| key(&now, "topic", topic, "depth").is_none())
        .map(|topic| format!("topic.{topic:?}.depth = {LONG}"))
        .collect();
    all.extend((!with.is_empty()).then(|| BagReading {
        what: format!("queues keep {LONG} messages"),
        with,
        is_phase: false,
    }));
    all
}

/// What a node may be as well.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum OtherKind {
    Silent,
    Timer,
    Triggered,
    Longer,
    Other,
}

impl OtherKind {
    /// Returns what a node with these other `keys` is.
    fn from_keys(keys: &str) -> Self {
        if keys.contains("only_new") && !keys.contains("takes") {
            return Self::Silent;
        }
        [
            ("rate", Self::Timer),
            ("trigger", Self::Triggered),
            ("takes", Self::Longer),
        ]
        .into_iter()
        .find(|(key, _)| keys.contains(key))
        .map_or(Self::Other, |(_, kind)| kind)
    }

    /// Returns what the node is, to follow its name.
    fn words(self) -> &'static str {
        match self {
            Self::Silent => "is silent without new data",
            Self::Timer => "is a timer",
            Self::Triggered => "is triggered",
            Self::Longer => "works longer",
            Self::Other => "is another one",
        }
    }
}

/// Returns the nodes that got another rate or a trigger, though the bag does not tell which of both
/// they have.
pub fn doubted(before: &str, now: &str) -> Vec<String> {
    let [before, now] = [before, now].map(|text| text.parse::<Table>().unwrap_or_default());
    let is_kept = |name: &str| {
        ["rate", "trigger"]
            .into_iter()
            .all(|of| key(&before, "node", name, of) == key(&now, "node", name, of))
    };
    let is_doubted = |(name, node): &(&String, &Table)| {
        let has_kind = others(node)
            .any(|keys| OtherKind::from_keys(keys) == OtherKind::Timer || keys.contains("trigger"));
        has_kind && !is_kept(name)
    };
    nodes(&before)
        .filter(is_doubted)
        .map(|(name, _)| name.clone())
        .collect()
}

/// Returns the nodes of a graph file.
fn nodes(file: &Table) -> impl Iterator<Item = (&String, &Table)> {
    let nodes = file.get("node").and_then(Value::as_table);
    let nodes = nodes.into_iter().flatten();
    nodes.filter_map(|(name, node)| Some((name, node.as_table()?)))
}

/// Returns the keys of each other reading of a node.
fn others(node: &Table) -> impl Iterator<Item = &str> {
    let others = node.get("or").and_then(Value::as_array);
    others.into_iter().flatten().filter_map(Value::as_str)
}

/// Returns a key in a section of a graph file.
fn key<'a>(file: &'a Table, section: &str, name: &str, key: &str) -> Option<&'a Value> {
    file.get(section)?.get(name)?.get(key)
}

/// Returns the number in `value`, which may be a whole one.
fn number(value: &Value) -> Option<f64> {
    let whole = || value.as_integer().map(|whole| whole as f64);
    value.as_float().or_else(whole)
}
