//! The first five minutes, played in a real terminal: every sentence of theirs
//! stands here beside the keys that it means and what must then be on the screen.

use std::{ops::Range, thread, time::Duration};

use crate::{page::Page, root, terminal::Lab};

const HEADING: &str = "## Your first five minutes\n";

/// A sentence or two of the README.
struct Moment {
    says: &'static str,
    /// What the reader does.
    keys: &'static str,
    /// What the reader must see then, in this order.
    sees: &'static [&'static str],
    /// What must be seen no more.
    gone: &'static [&'static str],
}

#[rustfmt::skip]
const MOMENTS: &[Moment] = &[
    Moment {
        says: "1. `cargo run`. Sensor, policy and actuator tick 50 times a second and meet only \
               in two topics.",
        keys: "",
        sees: &["BALANCED so far", "sensor", "/obs", "policy", "/action", "actuator", "● 50 Hz"],
        gone: &[],
    },
    Moment {
        says: "Nothing is dropped, the pole stays up, and sense→act is 0.0 ms: an action is \
               applied in the instant in which its reading was taken.",
        keys: "",
        sees: &["✓ 0 dropped", "sense→act  p50   0.0 ms  p99   0.0 ms  max   0.0 ms"],
        gone: &[],
    },
    Moment {
        says: "2. Press `[` four times. The policy decides 20 times a second now, the sensor \
               still reads 50 times: `/obs` shows ✖ and counts the readings that the policy never \
               sees.",
        keys: "[[[[",
        sees: &["policy at 20 Hz", "✖", "50.0/s", "20.0/s"],
        gone: &[],
    },
    Moment {
        says: "What an action goes back to is older now, and the pole does not care.",
        keys: "",
        sees: &["BALANCED so far"],
        gone: &["max   0.0 ms"],
    },
    Moment {
        says: "3. Press `[` eight times more, down to 5 Hz. A few seconds later the pole is down, \
               and the events say how old the readings behind its last actions were: the policy \
               decides every 200 ms.",
        keys: "[[[[[[[[",
        sees: &["policy at 5 Hz", "FELL at", "decides every 200 ms", "used readings up to"],
        gone: &[],
    },
    Moment {
        says: "4. `r` starts again: same seed, same knobs. The pole falls at 0.840 s.",
        keys: "r",
        sees: &["BALANCED so far", "FELL at 0.840 s"],
        gone: &[],
    },
    Moment {
        says: "Press `r` as often as you like: it falls at 0.840 s, every time.",
        keys: "r",
        sees: &["BALANCED so far", "FELL at 0.840 s", "dropped readings are the symptom"],
        gone: &[],
    },
    Moment {
        says: "5. Was it the drops? Press `>` six times, so that `/obs` keeps 100 messages, and \
               `r`. Nothing is dropped any more, and the pole falls at 0.840 s.",
        keys: ">>>>>>r",
        sees: &["BALANCED so far", "depth 100", "FELL at 0.840 s", "✓ 0 dropped", "a queue of 100 hides the symptom"],
        gone: &[],
    },
    Moment {
        says: "6. Press `]` five times, up to 10 Hz, and `r`: it stays up. The rate keeps the \
               robot alive, not the buffer.",
        keys: "]]]]]r",
        sees: &["● 10 Hz", "BALANCED so far"],
        gone: &[],
    },
    Moment {
        says: "7. `c` hands the running graph to the wall clock, where every node is a thread, \
               threads jitter, and no run is ever quite the same.",
        keys: "c",
        sees: &["on to the real clock"],
        gone: &[],
    },
    Moment {
        says: "`?` shows all keys,",
        keys: "?",
        sees: &["hand the running graph to the other clock"],
        gone: &[],
    },
    Moment {
        says: "`q` leaves, and prints what the last run came to.",
        keys: "?q",
        sees: &[],
        gone: &[],
    },
];

/// The part of the page that is played; nothing of any other page.
pub fn part(page: &Page) -> Range<usize> {
    let Some(start) = page.text.find(HEADING).map(|at| at + HEADING.len()) else {
        return 0..0;
    };
    let next = page.text[start..].find("\n## ");
    start..next.map_or(page.text.len(), |at| start + at)
}

fn words(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn the_first_five_minutes_of_the_manual_are_told_as_they_are_played() {
    let page = Page::read(root(), "README.md");
    let played: Vec<_> = MOMENTS.iter().map(|moment| moment.says).collect();
    assert_eq!(words(&page.text[part(&page)]), words(&played.join(" ")));
}

#[test]
fn the_first_five_minutes_of_the_manual_are_true() {
    let mut lab = Lab::open(&[], 45, 160);
    for moment in MOMENTS {
        for key in moment.keys.chars() {
            lab.type_keys(&key.to_string());
            // As fast as a reader can, and not all at once.
            thread::sleep(Duration::from_millis(70));
        }
        for seen in moment.sees {
            lab.wait_for(seen);
        }
        for gone in moment.gone {
            lab.wait_without(gone);
        }
    }
    let (status, parser) = lab.close();
    assert!(status.success());
    let said = parser.screen().contents();
    for line in ["control 10 Hz", "queue depth 100", "STOPPED"] {
        assert!(said.contains(line), "{line:?} is missing in\n{said}");
    }
}
