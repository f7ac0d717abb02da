//! Makes untrusted text safe to print on a terminal.

use std::path::Path;

pub use ratelab_recording::printable::in_line;

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn controls_are_escaped_and_the_rest_is_kept() {
        assert_eq!(one_line("\u{1b}[31mred\n"), r"\u{1b}[31mred\n");
        assert_eq!(one_line("txt.\u{202e}exe"), r"txt.\u{202e}exe");
        assert_eq!(one_line("→ é \"ü\" \\ '"), "→ é \"ü\" \\ '");
    }

    #[test]
    fn only_lines_and_colours_are_kept_in_a_text_of_many_lines() {
        let coloured = "one\n\u{1b}[1;31mred\u{1b}[0m\n";
        assert_eq!(in_lines(coloured), "one\n\\u{1b}[1;31mred\\u{1b}[0m\n");
        assert_eq!(in_coloured_lines(coloured), coloured);
        for (text, safe) in [
            ("\u{1b}]0;title\u{7}", r"\u{1b}]0;title\u{7}"),
            ("\u{1b}[2Jgone", r"\u{1b}[2Jgone"),
            ("\u{9b}2J\r\t\u{202e}é", r"\u{9b}2J\r\t\u{202e}é"),
            ("cut \u{1b}[31", r"cut \u{1b}[31"),
        ] {
            assert_eq!(in_lines(text), safe);
            assert_eq!(in_coloured_lines(text), safe);
        }
    }

    #[test]
    fn a_long_line_keeps_its_beginning_and_its_end() {
        let line = one_line(&format!("begins {} ends", "x ".repeat(50_000)));
        let whole = line.starts_with("begins x") && line.ends_with("x  ends");
        assert!(whole, "{line}");
        assert!(line.contains("(99212 characters)"), "{line}");
        let line = one_line(&format!("no {}, expected a", "x".repeat(10_000)));
        assert!(line.contains("x…x") && line.chars().count() < 120, "{line}");
        assert!(line.chars().count() < LONGEST);
    }
}
