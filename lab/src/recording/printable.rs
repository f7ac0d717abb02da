//! Texts of a file made fit for a terminal.

use serde_json::Value;

/// Replaces what commands a terminal in every text of `value`: a file may hold
/// anything.
pub fn make_printable(value: &mut Value) {
    match value {
        Value::String(text) => *text = text.replace(commands_a_terminal, "?"),
        Value::Array(values) => values.iter_mut().for_each(make_printable),
        Value::Object(map) => map.values_mut().for_each(make_printable),
        _ => {}
    }
}

/// Whether `c` is a control character, or one that changes how the text around
/// it is shown: those of the Unicode category Cf, and the separators of lines and
/// paragraphs. U+200C and U+200D are let through: file names in some scripts need
/// these two, and they join or part two letters at most.
fn commands_a_terminal(c: char) -> bool {
    c.is_control()
        || matches!(c,
            '\u{ad}'
            | '\u{600}'..='\u{605}'
            | '\u{61c}'
            | '\u{6dd}'
            | '\u{70f}'
            | '\u{890}'..='\u{891}'
            | '\u{8e2}'
            | '\u{180e}'
            | '\u{200b}'
            | '\u{200e}'..='\u{200f}'
            | '\u{2028}'..='\u{202e}'
            | '\u{2060}'..='\u{206f}'
            | '\u{feff}'
            | '\u{fff9}'..='\u{fffb}'
            | '\u{110bd}'
            | '\u{110cd}'
            | '\u{13430}'..='\u{1343f}'
            | '\u{1bca0}'..='\u{1bca3}'
            | '\u{1d173}'..='\u{1d17a}'
            | '\u{e0000}'..='\u{e007f}')
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
