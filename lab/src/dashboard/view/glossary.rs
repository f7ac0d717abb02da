//! The words and marks on the screen, in one line each.

/// Words and their meanings, marks first. A row may have several words, with commas
/// in between.
pub const GLOSSARY: &[(&str, &str)] = &[
    (
        "✖",
        "a run lost, a push too old, a message unread, a node down",
    ),
    (
        "⚠",
        "the run goes on, but its push is old, or it stands still",
    ),
    (
        "┊",
        "a limit of the push age (ms): it swings, then it falls",
    ),
    ("╌╌", "dashes along a curve: the run before this one"),
    (
        "age",
        "time since a message was published; of a topic, its newest",
    ),
    ("avg", "messages per second over the whole run"),
    (
        "clips",
        "of the motor: it gives its full force, whatever is asked",
    ),
    ("depth", "how many messages a topic keeps for a reader"),
    (
        "dropped",
        "pushed out of a full queue before its reader had read it",
    ),
    ("elsewhere", "a part of the push age that is not known"),
    ("falls", "the push is older than this loop can bear"),
    ("flat out", "virtual time as fast as the machine can"),
    ("fresh enough", "the push age is below the limits"),
    (
        "held",
        "the part of the push age while the push was in force",
    ),
    (
        "late",
        "a tick after its due time, a message after a newer one",
    ),
    ("lately", "in the last second of run time"),
    ("lost", "never arrived: its link lost the message"),
    ("msg/s", "messages per second in the last second"),
    (
        "on the way",
        "the part of the push age on the links of topics",
    ),
    (
        "operation",
        "one access to a topic, where ticks overlap in real time",
    ),
    ("overrun", "a period skipped, as the node was still busy"),
    ("p50, p99", "half of all values, 99 of 100, are no greater"),
    (
        "pole_fell",
        "the verdict in files: the pole was beyond 12 degrees",
    ),
    ("published", "messages of a topic so far"),
    ("push age", "age of the sensing behind the push in force"),
    (
        "quadratic cost",
        "mean of squared errors and effort; less is better",
    ),
    ("rate", "how often a node ticks (Hz)"),
    (
        "reaction time",
        "from a change to the first push that knows of it",
    ),
    ("read", "taken from its queue by a tick"),
    ("real-time factor", "run time per wall time: the speed"),
    ("seed", "start and all random numbers follow from it"),
    (
        "sense→act",
        "age of the sensing behind an action when it is applied",
    ),
    (
        "set aside for",
        "a tick that rests for one that is more urgent",
    ),
    ("sim, wall", "run time; time by your clock"),
    ("steps", "steps of the plant; a summary counts them"),
    ("swings", "the push is so old that small errors grow"),
    (
        "telemetry lost",
        "messages that the screen missed; the run did not",
    ),
    ("tick", "one period's work of a node, and how long it takes"),
    ("unread", "no tick took this message"),
    (
        "virtual, real",
        "the clock: the same to the bit each time, or the wall's",
    ),
    (
        "waited",
        "the part of the push age spent waiting to be read",
    ),
    (
        "waiting for",
        "due, but others had the executor or a match is missing",
    ),
    ("worked", "the part of the push age in ticks that take time"),
    (
        "world: own",
        "the plant moves by itself, with or without an action",
    ),
    (
        "world: waits",
        "the plant makes a step only when the actuator acts",
    ),
];

#[cfg(test)]
mod tests {
    use super::{
        super::{
            figures::{NODE_COLUMNS, TOPIC_COLUMNS},
            page::{EDGES, KEY_GAP},
            pane::{plain, testing::POOR, width},
            timeline::LEGEND,
        },
        GLOSSARY,
    };
    use crate::dashboard::frame::PartKind;

    /// Words on the screen that stand in no table.
    const ELSEWHERE: [&str; 22] = [
        "✖",
        "⚠",
        "flat out",
        "sim",
        "wall",
        "seed",
        "world: own",
        "world: waits",
        "virtual",
        "real",
        "telemetry lost",
        "push age",
        "reaction time",
        "sense→act",
        "swings",
        "falls",
        "fresh enough",
        "operation",
        "quadratic cost",
        "clips",
        "steps",
        "pole_fell",
    ];

    fn is_known(word: &str) -> bool {
        let mut words = GLOSSARY.iter().flat_map(|(words, _)| words.split(", "));
        words.any(|known| known == word || word.strip_suffix('s') == Some(known))
    }

    #[test]
    fn every_word_of_the_panes_is_in_the_glossary() {
        let columns = TOPIC_COLUMNS.iter().chain(&NODE_COLUMNS);
        let heads = columns.flat_map(|column| column.head.split(' '));
        let heads = heads.filter(|word| !["ms", "µs", "Hz"].contains(word));
        let parts = PartKind::ALL.into_iter().map(PartKind::word);
        let marks = LEGEND.iter().map(|(_, word)| *word);
        for word in heads.chain(parts).chain(marks).chain(ELSEWHERE) {
            assert!(is_known(word), "{word}");
        }
    }

    #[test]
    fn every_line_of_the_glossary_fits_80_columns_and_has_marks_in_ascii_too() {
        let widths = GLOSSARY
            .iter()
            .map(|(words, _)| width(&plain(words, &POOR)));
        let words = widths.max().unwrap_or_default();
        for (word, meaning) in GLOSSARY {
            let wide = words + KEY_GAP + width(meaning);
            assert!(wide <= 80 - EDGES, "{word}: {wide} columns");
            assert!(!plain(word, &POOR).contains('?'), "{word}");
        }
    }
}
