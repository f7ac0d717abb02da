//! Texts of others, made safe for a terminal.

use serde_json::Value;

/// Returns whether `c` is a control character or changes the display of the text around it: Unicode
/// category Cf, and the separators of lines and paragraphs. U+200C and U+200D are allowed: file
/// names in some scripts need them, and they join or separate two letters at most.
pub(crate) fn is_control(c: char) -> bool {
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

/// Returns `text` in one line, with the characters that control a terminal escaped, such as
/// `\u{1b}`.
pub fn in_line(text: &str) -> String {
    let mut line = String::with_capacity(text.len());
    for c in text.chars() {
        if is_control(c) {
            line.extend(c.escape_default());
        } else {
            line.push(c);
        }
    }
    line
}

/// The texts in knobs: a run is executed again with them, so they keep all characters.
const EXACT: [&str; 2] = ["what", "spec"];

/// Escapes the characters that control a terminal in every text of `value` except
/// knobs: a file may contain any.
pub fn make_printable(value: &mut Value) {
    match value {
        Value::String(text) if text.contains(is_control) => *text = in_line(text),
        Value::Array(values) => values.iter_mut().for_each(make_printable),
        Value::Object(map) => {
            let others = map.iter_mut().filter(|(key, _)| !EXACT.contains(&&***key));
            others.for_each(|(_, value)| make_printable(value));
        }
        _ => {}
    }
}
