//! Makes untrusted text safe to print on a terminal.

/// Maximum length of an error line (characters): enough for a long path.
const LONGEST: usize = 1_000;

/// Number of characters kept at the beginning and at the end of a longer line: the value
/// is at the start of an error, the expectation at its end.
const KEPT: (usize, usize) = (500, 300);

/// Whether `c` is a control character or changes the display of the text around it:
/// Unicode category Cf, and the separators of lines and paragraphs. U+200C and U+200D are
/// allowed: file names in some scripts need them, and they join or separate two letters
/// at most.
pub fn is_control(c: char) -> bool {
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

/// `text` in one line of limited length, with control characters escaped.
pub fn one_line(text: &str) -> String {
    let length = text.chars().count();
    if length <= LONGEST {
        return escaped(text.chars());
    }
    let (head, tail) = KEPT;
    format!(
        "{} … ({} characters) … {}",
        escaped(text.chars().take(head)),
        length - head - tail,
        escaped(text.chars().skip(length - tail))
    )
}

fn escaped(chars: impl Iterator<Item = char>) -> String {
    let mut line = String::new();
    for c in chars {
        if is_control(c) {
            line.extend(c.escape_default());
        } else {
            line.push(c);
        }
    }
    line
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
    fn a_long_line_keeps_its_beginning_and_its_end() {
        let line = one_line(&format!("begins {} ends", "x".repeat(100_000)));
        assert!(
            line.starts_with("begins x") && line.ends_with("x ends"),
            "{line}"
        );
        assert!(line.contains("(99212 characters)"), "{line}");
        assert!(line.chars().count() < LONGEST);
    }
}
