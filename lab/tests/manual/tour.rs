//! The first five minutes, played in a terminal of the usual size: the keys in the README, and the
//! expected texts on the screen.

use std::collections::BTreeSet;

use crate::{page::ManualPage, root, support::terminal::Lab};

const HEADING: &str = "## Your first five minutes\n";

/// A step of the README, or a part of one: keys to press, texts that must then appear in this
/// order, and one that must disappear.
type Moment = (&'static str, &'static [&'static str], Option<&'static str>);

#[rustfmt::skip]
const MOMENTS: &[Moment] = &[
    // Step 1.
    ("", &["BALANCED so far", "sensor", "/obs", "policy", "/action"], None),
    ("", &["actuator", "● 50 Hz"], None),
    ("", &["  0 dropped", "push age  10 ms, limit ?"], None),
    ("G", &["words", "messages per second"], None),
    ("\u{1b}", &["BALANCED so far"], Some("messages per second")),
    // Step 2.
    ("[[[[", &["control-hz 20", "● 20 Hz", "✖", "50.0/s"], None),
    ("", &["BALANCED so far"], Some("age  10 ms")),
    // Step 3.
    ("[[[[[[[[", &["● 5 Hz", "FELL at"], None),
    // Between these two the screen may say since when, if the pole fell soon after.
    ("", &["decides every 200 ms", "raises control-hz", "readings up to"], None),
    // Step 4.
    ("r", &["BALANCED so far", "FELL at 0.840 s"], None),
    ("r", &["BALANCED so far", "FELL at 0.840 s"], None),
    ("", &["identical to the last run, bit for bit", "readings were dropped"], None),
    // Step 5.
    ("]]]]]]]]r", &["● 20 Hz", "BALANCED so far"], None),
    ("e", &["● The control-rate cliff"], None),
    // Back to the graph.
    ("\u{1b}", &["BALANCED so far"], Some("● The control-rate cliff")),
    // Step 6.
    (">>>>>>", &["depth 100"], None),
    ("[[[[[[[[", &["● 5 Hz"], None),
    ("r", &["● 5 Hz", "  0 dropped"], None),
    // Step 7.
    ("]]]]]]]]]]]]r", &["● 50 Hz", "BALANCED so far"], None),
    ("c", &["cart-pole  real", "running"], None),
    ("?", &["show or hide this help"], None),
    ("?q", &[], None),
];

/// The keys named in this part of the README: code of a single character.
fn named(readme: &str) -> BTreeSet<char> {
    let (_, part) = readme.split_once(HEADING).expect(HEADING);
    let part = part.split("\n## ").next().unwrap_or_default();
    let code = part.split('`').skip(1).step_by(2);
    let keys = code.filter(|code| code.chars().count() == 1);
    keys.flat_map(str::chars).collect()
}

#[test]
fn the_first_five_minutes_of_the_manual_are_played_with_the_keys_that_they_name() {
    // Escape closes what a key has opened, and is no character to name.
    let played = MOMENTS.iter().flat_map(|(keys, ..)| keys.chars());
    let played = played.filter(|key| !key.is_control());
    let readme = ManualPage::read(root(), "README.md");
    assert_eq!(named(&readme.text), played.collect());
}

#[test]
fn the_first_five_minutes_of_the_manual_are_true() {
    let mut lab = Lab::open("", 24, 80);
    for (keys, sees, gone) in MOMENTS {
        lab.type_keys(keys);
        sees.iter().for_each(|seen| lab.wait_for(seen));
        if let Some(gone) = gone {
            lab.wait_without(gone);
        }
    }
    let said = lab.quit("");
    for words in [
        "period 20.0 ms)",
        "queue depth 100",
        "virtual → real",
        "STOPPED",
    ] {
        assert!(said.contains(words), "no {words:?} in\n{said}");
    }
}
