//! The first five minutes, played in a terminal of the usual size: the keys in the README, and the
//! expected texts on the screen.

use std::{collections::BTreeSet, thread, time::Duration};

use crate::{page::ManualPage, root, terminal::Lab};

const HEADING: &str = "## Your first five minutes\n";

/// A step of the README, or a part of one.
struct Moment {
    /// Keys to press.
    keys: &'static str,
    /// Texts that must then appear, in this order.
    sees: &'static [&'static str],
    /// Texts that must disappear.
    gone: &'static [&'static str],
}

#[rustfmt::skip]
const MOMENTS: &[Moment] = &[
    // Step 1.
    Moment {
        keys: "",
        sees: &["BALANCED so far", "sensor", "/obs", "policy", "/action", "actuator", "● 50 Hz"],
        gone: &[],
    },
    Moment {
        keys: "",
        sees: &["  0 dropped", "age  10 ms of 90"],
        gone: &[],
    },
    // Step 2.
    Moment {
        keys: "[[[[",
        sees: &["control-hz 20", "● 20 Hz", "✖", "50.0/s"],
        gone: &[],
    },
    Moment {
        keys: "",
        sees: &["BALANCED so far"],
        gone: &["age  10 ms"],
    },
    // Step 3.
    Moment {
        keys: "[[[[[[[[",
        sees: &["● 5 Hz", "FELL at", "decides every 200 ms. ] raises control-hz", "readings up to"],
        gone: &[],
    },
    // Step 4.
    Moment {
        keys: "r",
        sees: &["BALANCED so far", "FELL at 0.840 s"],
        gone: &[],
    },
    Moment {
        keys: "r",
        sees: &["BALANCED so far", "FELL at 0.840 s", "identical to the last run, bit for bit", "readings were dropped"],
        gone: &[],
    },
    // Step 5.
    Moment {
        keys: "]]]]]]]]r",
        sees: &["● 20 Hz", "BALANCED so far"],
        gone: &[],
    },
    Moment {
        keys: "e",
        sees: &["1 The control-rate cliff"],
        gone: &[],
    },
    // Back to the graph.
    Moment {
        keys: "\u{1b}",
        sees: &["BALANCED so far"],
        gone: &["1 The control-rate cliff"],
    },
    // Step 6.
    Moment {
        keys: ">>>>>>",
        sees: &["depth 100"],
        gone: &[],
    },
    // Step 7.
    Moment {
        keys: "c",
        sees: &["cart-pole  real"],
        gone: &[],
    },
    Moment {
        keys: "?",
        sees: &["show or hide this help"],
        gone: &[],
    },
    Moment {
        keys: "?q",
        sees: &[],
        gone: &[],
    },
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
    let played = MOMENTS.iter().flat_map(|moment| moment.keys.chars());
    let played = played.filter(|key| !key.is_control());
    let readme = ManualPage::read(root(), "README.md");
    assert_eq!(named(&readme.text), played.collect());
}

#[test]
fn the_first_five_minutes_of_the_manual_are_true() {
    let mut lab = Lab::open("", 24, 80);
    for moment in MOMENTS {
        for key in moment.keys.chars() {
            lab.type_keys(&key.to_string());
            // At the speed of a fast reader.
            thread::sleep(Duration::from_millis(70));
        }
        for seen in moment.sees {
            lab.wait_for(seen);
        }
        for gone in moment.gone {
            lab.wait_without(gone);
        }
    }
    let said = lab.quit("");
    // Knobs obeyed at the same time are written as the alias that sets them all.
    let depth = ["depth /action 100", "queue-depth 100"];
    for words in [&["period 50.0 ms)"][..], &depth, &["STOPPED", "s: stop"]] {
        let one_of = words.iter().any(|line| said.contains(line));
        assert!(one_of, "none of {words:?} in\n{said}");
    }
}
