//! Names of a system's knobs, topics and figures as texts and tables have them.

use std::path::Path;

use ratelab::{
    runtime::KnobKind,
    system::{Alias, Setup, System},
};
use serde_json::{Value, json};

/// A name for programs: `control_hz` of `control-hz`, `obs` of `/obs`.
pub fn key(name: &str) -> String {
    let words = name.split(|c: char| !c.is_alphanumeric());
    let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
    words.join("_")
}

/// A label for the knob called `name`: `control` of `control-hz`, `queue
/// depth` of `queue-depth`, `pilot` of `rate pilot`, `pilot cost` of `takes pilot`.
pub fn label(name: &str) -> String {
    match name.split_once(' ') {
        Some(("rate" | "send", node)) => node.to_owned(),
        Some(("takes", node)) => format!("{node} cost"),
        Some(("wakes", node)) => format!("{node} delay"),
        Some((kind, target)) => format!("{target} {kind}"),
        None => name.strip_suffix("-hz").unwrap_or(name).replace('-', " "),
    }
}

/// The name of a node in texts: that of the alias for its rate, if it has one.
pub fn node_label(system: &dyn System, node: &str) -> String {
    let rate = rate_alias(system, |of| of == node);
    label(rate.map_or(node, |alias| alias.name))
}

/// The first alias of this kind.
pub fn first_alias(system: &dyn System, kind: KnobKind) -> Option<&'static Alias> {
    let mut aliases = system.aliases().iter();
    aliases.find(|alias| alias.kind() == kind)
}

/// The node of the first alias for a rate: its rate matters most.
pub fn paced_node(system: &dyn System) -> Option<&'static str> {
    let (_, node) = first_alias(system, KnobKind::Rate)?.knobs.first()?;
    Some(node)
}

/// The first alias for the rate of a node that is `wanted`.
pub fn rate_alias(system: &dyn System, wanted: impl Fn(&str) -> bool) -> Option<&'static Alias> {
    let mut aliases = system.aliases().iter();
    aliases.find(|alias| {
        let mut knobs = alias.knobs.iter();
        knobs.any(|(kind, of)| *kind == KnobKind::Rate && wanted(of))
    })
}

/// A short text of a message to a node: for a file, its name without folder and digest.
pub fn short(system: &dyn System, node: &str, text: &str) -> String {
    let file = system.file(node, text);
    let name = file.as_deref().and_then(Path::file_name);
    name.map_or_else(|| text.to_owned(), |name| name.to_string_lossy().into())
}

/// A short text of the value of `alias` in `setup`.
pub fn short_value(system: &dyn System, alias: &Alias, setup: &Setup) -> String {
    let value = alias.value(setup);
    match alias.knobs {
        [(KnobKind::Send, node), ..] => short(system, node, &value),
        _ => value,
    }
}

/// The value of a knob for programs.
pub fn value(kind: KnobKind, text: &str) -> Value {
    match kind {
        KnobKind::Rate => json!(text.parse::<f64>().ok()),
        KnobKind::Depth => json!(text.parse::<usize>().ok()),
        _ => json!(text),
    }
}

/// A word for runs that are not lost: their usual verdict, such as `balanced`.
pub fn good(system: &dyn System) -> String {
    let verdicts = system.verdicts();
    let usual = verdicts
        .first()
        .filter(|_| verdicts.iter().any(|verdict| verdict.lost));
    usual
        .map_or("not lost", |verdict| verdict.name)
        .replace('_', " ")
}
