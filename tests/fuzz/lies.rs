//! JSON with one field changed.

use rand::{Rng, seq::IndexedRandom};
use serde_json::{Value, json};

use crate::cases::{RandomSource, chance, pick_from};

/// An additional knob for lists of knobs.
const KNOB: &str = r#"{"at": 100000000, "knob": {"QueueDepth": 3}}"#;

/// Number of entries that make a list very long.
const MANY: usize = 20_000;

/// Changes one field in JSON, or leaves it as it was; describes the change.
pub fn change_json(value: &mut Value, random: &mut RandomSource) -> String {
    let mut paths = Vec::new();
    collect(value, String::new(), &mut paths);
    let path = paths.choose(random).expect("a field");
    let how = change_at(value, path, random);
    format!("{path}: {how}")
}

/// Collects the positions in `value` as JSON pointers, without `path` itself.
fn collect(value: &Value, path: String, paths: &mut Vec<String>) {
    let children: Vec<_> = match value {
        Value::Object(fields) => fields
            .iter()
            .map(|(name, value)| (name.clone(), value))
            .collect(),
        Value::Array(values) => values
            .iter()
            .enumerate()
            .map(|(at, value)| (at.to_string(), value))
            .collect(),
        _ => Vec::new(),
    };
    for (name, child) in children {
        let path = format!("{path}/{}", name.replace('~', "~0").replace('/', "~1"));
        paths.push(path.clone());
        collect(child, path, paths);
    }
}

fn change_at(whole: &mut Value, path: &str, random: &mut RandomSource) -> String {
    let value = whole.pointer_mut(path).expect("a field");
    let old = value.to_string();
    // `null` and a missing field have the same meaning.
    if !value.is_null() && chance(random, 10) {
        return remove(whole, path);
    }
    match value {
        _ if chance(random, 10) => *value = pick_from(random, RUBBISH).parse().expect("JSON"),
        Value::Array(values) => change_array(values, random),
        Value::Number(number) => *value = change_number(number, random),
        Value::String(text) => *text = change_text(text, random),
        Value::Bool(truth) => *truth = !*truth,
        _ => {}
    }
    let new = value.to_string();
    let short = |text: &str| text.chars().take(100).collect::<String>();
    format!("{} became {}", short(&old), short(&new))
}

fn remove(whole: &mut Value, path: &str) -> String {
    let (parent, name) = path.rsplit_once('/').expect("a pointer");
    match whole.pointer_mut(parent) {
        Some(Value::Object(fields)) => drop(fields.remove(&name.replace("~1", "/"))),
        Some(Value::Array(values)) => drop(values.remove(name.parse().expect("an index"))),
        _ => panic!("{path} is nowhere"),
    }
    "removed".to_owned()
}

/// Values of other kinds, separated by `|`.
const RUBBISH: &str = r#"null|{}|[]|""|-1|18446744073709551615|"\u001b[2J""#;

fn change_array(values: &mut Vec<Value>, random: &mut RandomSource) {
    let knob = serde_json::from_str(KNOB).expect("JSON");
    let more = values.choose(random).cloned().unwrap_or(knob);
    match random.random_range(0..4) {
        // Knobs may be in any order, because each has its time.
        0 if !values.iter().any(|value| value.get("knob").is_some()) => values.reverse(),
        1 => values.extend(vec![more; MANY]),
        _ => values.push(more),
    }
}

fn change_number(number: &serde_json::Number, random: &mut RandomSource) -> Value {
    if let Some(whole) = number.as_u64() {
        let others = [
            0,
            1,
            whole.wrapping_add(1),
            whole.wrapping_sub(1),
            whole.wrapping_mul(1_000),
            1 << 62,
            u64::MAX,
        ];
        return json!(others.choose(random));
    }
    let number = number.as_f64().expect("a number");
    json!([0.0, 1.0, -number, number + 1.0, number * 1.5, 1e300].choose(random))
}

/// Names to lie with, separated by `|`.
const NAMES: &str = "|x|policy|sensor|actuator|/obs|/action|/state|Virtual|Real|Lqr|Zero|FlatOut|\
    Balanced|balanced|/etc/passwd|\u{1b}[31m|\u{202e}";

/// Another text: a known name, or an unknown one.
fn change_text(text: &str, random: &mut RandomSource) -> String {
    match random.random_range(0..4) {
        0 => format!("{text} "),
        1 => text.repeat(1_000),
        _ => pick_from(random, NAMES).to_owned(),
    }
}
