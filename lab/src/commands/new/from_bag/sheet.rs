//! The text of a graph file, with the tables that it names.

use std::fmt::Write;

use super::GraphOfBag;

/// Numbers in a file beside the graph file, a line each.
pub struct ValueTable {
    /// The name of the file in its folder.
    pub file: String,
    /// Its content.
    pub text: String,
}

/// What is written of a graph.
pub struct GraphSheet {
    data: String,
    text: String,
    tables: Vec<ValueTable>,
    knobs: Vec<(f64, String)>,
    sources: Vec<String>,
}

impl GraphSheet {
    /// The beginning of the graph called `name`, whose tables are in the folder `data`.
    pub fn new(name: &str, data: &str) -> Self {
        Self {
            data: data.to_owned(),
            text: format!("name = {}\n", quoted(name)),
            tables: Vec::new(),
            knobs: Vec::new(),
            sources: Vec::new(),
        }
    }

    /// Adds a line.
    pub fn line(&mut self, line: &str) {
        self.text.push_str(line);
        self.text.push('\n');
    }

    /// The value of a key that has `values` (ms): a number if they are nearly one, or else a file
    /// of them, by the names of its `node` and the key. `None` of zeros.
    pub fn values(&mut self, node: &str, key: &str, values: &[f64]) -> Option<String> {
        const SAME: f64 = 0.02;
        let least = values.iter().copied().reduce(f64::min)?;
        let greatest = values.iter().copied().fold(least, f64::max);
        if greatest - least < SAME {
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            let number = number(mean);
            return (number != "0").then_some(number);
        }
        let file = format!("{node}.{key}.csv");
        let mut text = format!("{key}_ms\n");
        for value in values {
            let _ = writeln!(text, "{}", number(*value)); // Into a string: it cannot fail.
        }
        let value = quoted(&format!("file:{}/{file}", self.data));
        self.tables.push(ValueTable { file, text });
        Some(value)
    }

    /// Adds a knob that is turned at `ms`.
    pub fn knob(&mut self, ms: f64, knob: String) {
        self.knobs.push((ms, knob));
    }

    /// Notes that the node called `name` has a source before it.
    pub fn add_source(&mut self, name: &str) {
        self.sources.push(name.to_owned());
    }

    /// Whether the node called `name` has a source before it.
    pub fn has_source(&self, name: &str) -> bool {
        self.sources.iter().any(|known| known == name)
    }

    /// What was written of a bag that ends after `seconds`.
    pub fn finish(mut self, seconds: f64) -> GraphOfBag {
        self.knobs.sort_by(|one, other| one.0.total_cmp(&other.0));
        let knobs = self.knobs.iter();
        GraphOfBag {
            knobs: knobs
                .map(|(ms, knob)| format!("{} {knob}\n", number(ms / 1e3)))
                .collect(),
            seconds: (seconds * 1e3).ceil() / 1e3,
            text: self.text,
            tables: self.tables,
        }
    }
}

/// The source before the node called `name`.
pub fn source_of(name: &str) -> String {
    format!("{name}_source")
}

/// `value` with up to six digits behind the point.
pub fn number(value: f64) -> String {
    let text = format!("{value:.6}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" {
        "0".to_owned()
    } else {
        text.to_owned()
    }
}

/// `value` with nine digits.
pub fn nine_digits(value: f64) -> String {
    let before = value.abs().log10().floor().max(0.0) as usize + 1;
    let text = format!("{value:.*}", 9_usize.saturating_sub(before).min(6));
    if text.contains('.') {
        return text.trim_end_matches('0').trim_end_matches('.').to_owned();
    }
    text
}

/// `text` as a string of TOML.
pub fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// The name of a node after a topic.
pub fn node_name(topic: &str) -> String {
    let name = topic.strip_prefix('/').unwrap_or(topic);
    let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    let name: String = name
        .chars()
        .map(|c| if is_plain(c) { c } else { '_' })
        .collect();
    if name.is_empty() {
        "_".to_owned()
    } else {
        name
    }
}
