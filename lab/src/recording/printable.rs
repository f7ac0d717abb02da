//! Texts of a file, made safe for a terminal.

use serde_json::Value;

use crate::printable::is_control;

/// The texts in knobs: a run is executed again with them, so they keep all characters.
const EXACT: [&str; 2] = ["what", "spec"];

/// Replaces the characters that control a terminal in every text of `value` but those of
/// knobs: a file may contain any.
pub fn make_printable(value: &mut Value) {
    match value {
        Value::String(text) => *text = text.replace(is_control, "?"),
        Value::Array(values) => values.iter_mut().for_each(make_printable),
        Value::Object(map) => {
            let others = map.iter_mut().filter(|(key, _)| !EXACT.contains(&&***key));
            others.for_each(|(_, value)| make_printable(value));
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::make_printable;

    #[test]
    fn what_turns_a_line_around_is_replaced_and_letters_are_not() {
        let mut value = json!({"nodes": ["a\u{202e}b", "c\u{1b}[2J", "d\u{2066}\u{feff}"], "n": 1});
        make_printable(&mut value);
        assert_eq!(value, json!({"nodes": ["a?b", "c?[2J", "d??"], "n": 1}));
        let names = json!("modèles/می‌روم 実験.pt");
        let mut same = names.clone();
        make_printable(&mut same);
        assert_eq!(same, names);
    }
}
