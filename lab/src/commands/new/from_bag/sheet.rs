//! The text of a graph file, with the tables that it names.

use std::{collections::BTreeSet, fmt::Write};

use super::GraphOfBag;

/// Numbers in a file beside the graph file, a line each.
pub struct ValueTable {
    /// The name of the file in its folder.
    pub file: String,
    /// Its content.
    pub text: String,
}

/// The longest name of a node, which is part of the name of a file.
const MAX_NAME: usize = 100;

/// What is written of a graph.
pub struct GraphSheet {
    data: String,
    text: String,
    tables: Vec<ValueTable>,
    knobs: Vec<(f64, String)>,
    sources: Vec<String>,
}

impl GraphSheet {
    /// Creates the beginning of the graph called `name`, whose tables are in the folder `data`.
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

    /// Returns the value of a key that has `values` (ms): a number if they are nearly one, or else
    /// a file of them, by the names of its `node` and the key. `None` of zeros.
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

    /// Returns whether the node called `name` has a source before it.
    pub fn has_source(&self, name: &str) -> bool {
        self.sources.iter().any(|known| known == name)
    }

    /// Writes the knobs, each at its time.
    fn events(&mut self) {
        let mut knobs = std::mem::take(&mut self.knobs);
        knobs.sort_by(|one, other| one.0.total_cmp(&other.0));
        let timed: Vec<(String, String)> = knobs
            .into_iter()
            .map(|(ms, knob)| (number(ms / 1e3), quoted(&knob)))
            .collect();
        if !timed.is_empty() {
            self.line("\n[at]   # seconds: when the bag had nothing of a sensor");
        }
        for of_time in timed.chunk_by(|one, other| one.0 == other.0) {
            let knobs: Vec<&str> = of_time.iter().map(|(_, knob)| &**knob).collect();
            let knobs = match knobs[..] {
                [only] => only.to_owned(),
                _ => format!("[{}]", knobs.join(", ")),
            };
            self.line(&format!("\"{}\" = {knobs}", of_time[0].0));
        }
    }

    /// Returns what was written of a bag that ends after `seconds`.
    pub fn finish(mut self, seconds: f64) -> GraphOfBag {
        self.events();
        GraphOfBag {
            seconds: (seconds * 1e3).ceil() / 1e3,
            text: self.text,
            tables: self.tables,
        }
    }
}

/// Returns the source before the node called `name`.
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

/// Returns the names that topics have in a graph file, and of the nodes after them: each another
/// one.
pub fn names<'a>(topics: impl Iterator<Item = &'a str>) -> Vec<(String, String)> {
    let mut taken = BTreeSet::new();
    let names = topics.map(|topic| {
        let node = node_name(topic);
        let others = (2..).map(|number| format!("{node}_{number}"));
        let own = std::iter::once(node.clone())
            .chain(others)
            .find(|name| taken.insert(name.clone()))
            .unwrap_or_default();
        let is_plain = |c: char| is_of_node(c) || c == '/';
        if own == node && topic.starts_with('/') && topic.chars().all(is_plain) {
            return (topic.to_owned(), own);
        }
        (format!("/{own}"), own)
    });
    names.collect()
}

fn is_of_node(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_' || c == '-'
}

/// Returns the name of a node after a topic.
pub fn node_name(topic: &str) -> String {
    let name = topic.strip_prefix('/').unwrap_or(topic);
    let plain = |c: char| if is_of_node(c) { c } else { '_' };
    let name: String = name.chars().take(MAX_NAME).map(plain).collect();
    if name.is_empty() {
        "_".to_owned()
    } else {
        name
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_as_short_as_they_can_be() {
        for (value, expected) in [
            (10.0, "10"),
            (0.5, "0.5"),
            (-1e-9, "0"),
            (1.0 / 3.0, "0.333333"),
        ] {
            assert_eq!(number(value), expected);
        }
        assert_eq!(nine_digits(29.999_999_4), "29.999999");
        assert_eq!(nine_digits(12.5), "12.5");
    }

    #[test]
    fn values_that_are_nearly_one_are_their_mean_and_others_a_table() {
        let mut sheet = GraphSheet::new("robot", "robot.data");
        assert_eq!(
            sheet.values("a", "takes", &[5.0, 5.01]).as_deref(),
            Some("5.005")
        );
        assert_eq!(sheet.values("a", "wakes", &[0.0, 0.0]), None);
        let table = sheet.values("a", "takes", &[5.0, 6.5]);
        assert_eq!(table.as_deref(), Some("\"file:robot.data/a.takes.csv\""));
        let tables = sheet.finish(1.0).tables;
        assert_eq!(tables[0].text, "takes_ms\n5\n6.5\n");
    }

    #[test]
    fn nodes_have_the_names_of_their_topics_in_plain_letters() {
        let found = names(["/a/b", "/a_b", "c d"].into_iter());
        let of = |topic: &str, node: &str| (topic.to_owned(), node.to_owned());
        let expected = [of("/a/b", "a_b"), of("/a_b_2", "a_b_2"), of("/c_d", "c_d")];
        assert_eq!(found, expected);
        assert_eq!(node_name("/cam/image_raw"), "cam_image_raw");
        assert_eq!(node_name("/"), "_");
        assert_eq!(quoted("a\"b"), "\"a\\\"b\"");
    }
}
