//! Texts of a file, on a terminal.

use ratelab_recording::printable::{in_coloured_lines, in_lines, make_printable, one_line};
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
    assert!(line.chars().count() < 1_000);
}
