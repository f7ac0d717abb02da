//! The words and marks on the screen, in one line each.

/// Words and their meanings, marks first, with blanks in between. A row may have several
/// words, with commas in between.
const GLOSSARY: &str = include_str!("glossary.txt");

/// The words of plans in the same form.
const OF_PLANS: &str = include_str!("glossary_plans.txt");

/// Returns the words of each row and their meaning, with the words of plans if `planned`.
pub fn glossary(planned: bool) -> impl Iterator<Item = (&'static str, &'static str)> {
    let of_plans = OF_PLANS.lines().filter(move |_| planned);
    GLOSSARY
        .lines()
        .chain(of_plans)
        .filter_map(|row| row.split_once("  "))
        .map(|(words, meaning)| (words, meaning.trim_start()))
}

#[cfg(test)]
mod tests {
    use super::{
        super::{
            figures::{NODE_COLUMNS, TOPIC_COLUMNS},
            page::{EDGES, KEY_GAP},
            testing::POOR,
            text::{plain, width},
            timeline::LEGEND,
        },
        GLOSSARY, OF_PLANS, glossary,
    };
    use crate::age::PARTS;

    /// Words on the screen that stand in no table.
    const ELSEWHERE: &str = "✖, ⚠, max, sim, wall, seed, world: own, world: waits, virtual, \
        real, telemetry lost, push age, reaction time, sense→act, more (i), latency, \
        node, topic, knob, policy, plant, push, action, reading, phase, swings, falls, fresh enough, \
        operation, quadratic cost, clips, steps, pole_fell";

    fn is_known(word: &str) -> bool {
        let mut words = glossary(true).flat_map(|(words, _)| words.split(", "));
        words.any(|known| known == word || word.strip_suffix('s') == Some(known))
    }

    #[test]
    fn every_word_of_the_panes_is_in_the_glossary() {
        let topics = TOPIC_COLUMNS.into_iter().map(|column| column.head);
        let heads = topics
            .chain(NODE_COLUMNS.into_iter().map(|column| column.head))
            .flat_map(|head| head.split(' '))
            .filter(|word| !["ms", "µs", "Hz"].contains(word));
        let parts = PARTS.map(|[_, word]| word).into_iter();
        let marks = LEGEND.iter().map(|(_, _, word)| *word);
        let elsewhere = ELSEWHERE.split(", ");
        for word in heads.chain(parts).chain(marks).chain(elsewhere) {
            assert!(is_known(word), "{word}");
        }
    }

    #[test]
    fn every_line_of_the_glossary_fits_80_columns_and_has_marks_in_ascii_too() {
        let rows = GLOSSARY.lines().chain(OF_PLANS.lines());
        assert_eq!(glossary(true).count(), rows.count());
        let widths = glossary(true).map(|(words, _)| width(&plain(words, &POOR)));
        let words = widths.max().unwrap_or_default();
        for (word, meaning) in glossary(true) {
            let wide = words + KEY_GAP + width(meaning);
            assert!(wide <= 80 - EDGES, "{word}: {wide} columns");
            assert!(!plain(word, &POOR).contains('?'), "{word}");
        }
    }
}
