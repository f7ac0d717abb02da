//! Texts of a file, on a terminal.

use ratelab_recording::printable::make_printable;
use serde_json::json;

#[test]
fn what_turns_a_line_around_is_escaped_and_letters_are_not() {
    let mut value = json!({"nodes": ["a\u{202e}b", "c\u{1b}[2J", "d\u{2066}\u{feff}"], "n": 1});
    make_printable(&mut value);
    assert_eq!(
        value,
        json!({"nodes": [r"a\u{202e}b", r"c\u{1b}[2J", r"d\u{2066}\u{feff}"], "n": 1})
    );
    let names = json!("modèles/می‌روم 実験.pt");
    let mut same = names.clone();
    make_printable(&mut same);
    assert_eq!(same, names);
}
