//! Texts of others, made safe for a terminal: whole, in a line of limited length, as cells.

use std::path::Path;

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
            map.iter_mut()
                .filter(|(key, _)| !EXACT.contains(&&***key))
                .for_each(|(_, value)| make_printable(value));
        }
        _ => {}
    }
}

/// Maximum length of an error line (characters): enough for a long path.
const LONGEST: usize = 1_000;

/// Number of characters kept at the beginning and at the end of a longer line: the value
/// is at the start of an error, the expectation at its end.
const KEPT: (usize, usize) = (500, 300);

/// Length of the longest word that is printed whole in an error (characters): more than a usual
/// path has.
const LONGEST_WORD: usize = 250;

/// Returns `text` with the middle of longer words left out.
fn with_short_words(text: &str) -> String {
    let short = |word: &str| {
        let length = word.chars().count();
        if length <= LONGEST_WORD {
            return word.to_owned();
        }
        let end: String = word.chars().skip(length - 20).collect();
        word.chars()
            .take(60)
            .chain("…".chars())
            .chain(end.chars())
            .collect()
    };
    let words: Vec<String> = text.split(' ').map(short).collect();
    words.join(" ")
}

/// Returns `text` in one line of limited length, with control characters escaped.
pub fn one_line(text: &str) -> String {
    let text = &with_short_words(text);
    let length = text.chars().count();
    if length <= LONGEST {
        return in_line(text);
    }
    let (head, tail) = KEPT;
    let (first, last): (String, String) = (
        text.chars().take(head).collect(),
        text.chars().skip(length - tail).collect(),
    );
    format!(
        "{} … ({} characters) … {}",
        in_line(&first),
        length - head - tail,
        in_line(&last)
    )
}

/// Returns `path` as it is printed, without characters that control a terminal.
pub fn shown(path: &Path) -> String {
    in_line(&path.display().to_string())
}

/// Returns `text` as it is, but for control characters: the ends of lines stay.
pub fn in_lines(text: &str) -> String {
    let lines: Vec<String> = text.split('\n').map(in_line).collect();
    lines.join("\n")
}

/// Returns `text` as it is, but for control characters: the ends of lines and colours stay. Whoever
/// made the colours has made the texts of others printable before.
pub fn in_coloured_lines(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let kept = match c {
            '\n' => 1,
            '\u{1b}' => colour_length(rest),
            _ => 0,
        };
        let (head, tail) = rest.split_at(if kept > 0 { kept } else { c.len_utf8() });
        match kept {
            0 => safe.push_str(&in_line(head)),
            _ => safe.push_str(head),
        }
        rest = tail;
    }
    safe
}

/// Returns the length of the escape sequence for a colour at the beginning of `text`; 0 without
/// one.
fn colour_length(text: &str) -> usize {
    let digits = |c: char| c.is_ascii_digit() || c == ';';
    let after = text.strip_prefix("\u{1b}[");
    let end = after.and_then(|after| after.trim_start_matches(digits).strip_prefix('m'));
    end.map_or(0, |end| text.len() - end.len())
}

/// Returns a row with these cells, printable, and quoted by RFC 4180 where a comma or a quote is in
/// one.
pub fn row_of(cells: impl IntoIterator<Item = String>) -> String {
    cells
        .into_iter()
        .map(|cell| match in_line(&cell) {
            cell if cell.contains([',', '"']) => format!("\"{}\"", cell.replace('"', "\"\"")),
            cell => cell,
        })
        .collect::<Vec<_>>()
        .join(",")
}
