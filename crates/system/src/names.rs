//! Names of a system's knobs, topics and figures, for texts and tables.

use std::path::Path;

use ratelab::{Digest, KnobKind};

use super::{Alias, Setup, System};

/// Returns a name for programs: `control_hz` of `control-hz`, `obs` of `/obs`.
pub fn key(name: &str) -> String {
    let words = name.split(|c: char| !c.is_alphanumeric());
    let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
    words.join("_")
}

/// Returns the subject of the knob called `name`: `control` for `control-hz`, `queue depth` for
/// `queue-depth`, `think time` for `think-ms`, `pilot` for `rate pilot`, `pilot cost` for
/// `takes pilot`, `/obs delay` for `link /obs delay:{}`.
pub fn label(name: &str) -> String {
    if let Some(filled) = name.strip_suffix(":{}").or(name.strip_suffix(" {}")) {
        let of_link = filled.strip_prefix("link ");
        return of_link.map_or_else(|| label(filled), str::to_owned);
    }
    match name.split_once(' ') {
        Some(("rate" | "send" | "set", node)) => node.to_owned(),
        Some(("takes", node)) => format!("{node} cost"),
        Some(("wakes", node)) => format!("{node} delay"),
        Some((kind, target)) => format!("{target} {kind}"),
        None => match name.strip_suffix("-ms") {
            Some(what) => format!("{} time", what.replace('-', " ")),
            None => name.strip_suffix("-hz").unwrap_or(name).replace('-', " "),
        },
    }
}

/// Returns the unit of a number that the knob called `name` takes, with a blank before it.
pub fn unit(name: &str, kind: KnobKind) -> &'static str {
    let before = name.split("{}").next().unwrap_or_default();
    let has_time = matches!(kind, KnobKind::Link | KnobKind::Send);
    let mut times = ["delay:", "reliable:", "zero:"].into_iter();
    match kind.unit() {
        "" if has_time && times.any(|time| before.ends_with(time)) => " ms",
        unit => unit,
    }
}

/// Returns the name of a node in texts: from the alias for its rate, else its own.
pub fn node_label(system: &dyn System, node: &str) -> String {
    let rate = rate_alias(system, |of| of == node);
    label(rate.map_or(node, |alias| alias.name))
}

/// Returns the first alias of this kind.
pub fn first_alias(system: &dyn System, kind: KnobKind) -> Option<&'static Alias> {
    system
        .knobs()
        .aliases()
        .iter()
        .find(|alias| alias.kind() == kind)
}

/// Returns the node of the first alias for a rate: its rate matters most.
pub fn paced_node(system: &dyn System) -> Option<&'static str> {
    let first = first_alias(system, KnobKind::Rate)?;
    first.knobs.first().map(|(_, node)| *node)
}

/// Returns the first alias for the rate of a node for which `wanted` is true.
pub fn rate_alias(system: &dyn System, wanted: impl Fn(&str) -> bool) -> Option<&'static Alias> {
    system.knobs().aliases().iter().find(|alias| {
        alias
            .knobs
            .iter()
            .any(|(kind, of)| *kind == KnobKind::Rate && wanted(of))
    })
}

/// Returns the aliases to be shown. A cost, a parameter, and a message other than the first, is
/// shown where it is `wanted`.
pub fn shown(system: &dyn System, wanted: impl Fn(&Alias) -> bool) -> Vec<&'static Alias> {
    let first = first_alias(system, KnobKind::Send);
    let shown = |alias: &&Alias| match alias.kind() {
        KnobKind::Takes | KnobKind::Parameter => wanted(alias),
        KnobKind::Send => first == Some(*alias) || wanted(alias),
        _ => true,
    };
    system.knobs().aliases().iter().filter(shown).collect()
}

/// Returns whether `alias` is set away from its default in `setup`.
pub fn is_set(alias: &Alias, setup: &Setup) -> bool {
    alias.value(setup) != alias.default
}

/// Returns the short form of a message to a node: for a file, its name without folder and digest.
pub fn short(system: &dyn System, node: &str, text: &str) -> String {
    let file = system.knobs().file(node, text);
    let name = file.as_deref().and_then(Path::file_name);
    name.map_or_else(|| text.to_owned(), |name| name.to_string_lossy().into())
}

/// Returns the short form of the value of `alias` in `setup`.
pub fn short_value(system: &dyn System, alias: &Alias, setup: &Setup) -> String {
    let value = alias.value(setup);
    match alias.knobs {
        [(KnobKind::Send, node), ..] => short(system, node, &value),
        // Of a file its name; its digest is for recordings.
        _ => value.split(Digest::PIN).take(1).collect(),
    }
}

/// Returns a word for successful runs: their usual verdict, such as `balanced`.
pub fn good(system: &dyn System) -> String {
    let verdicts = system.verdicts();
    verdicts
        .first()
        .filter(|_| verdicts.iter().any(|verdict| verdict.lost))
        .map_or("not lost", |verdict| &verdict.name)
        .replace('_', " ")
}
