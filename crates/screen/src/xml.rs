//! Text in XML: SVG files and pages.

/// Returns `text` between two tags, or in an attribute. Control characters, which XML refuses,
/// become blanks.
pub fn escaped(text: &str) -> String {
    let mut xml = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => xml.push_str("&amp;"),
            '<' => xml.push_str("&lt;"),
            '>' => xml.push_str("&gt;"),
            '"' => xml.push_str("&quot;"),
            '\u{fffe}' | '\u{ffff}' => xml.push(' '),
            c if c.is_control() && c != '\n' => xml.push(' '),
            c => xml.push(c),
        }
    }
    xml
}
