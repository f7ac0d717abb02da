//! The knobs that keys turn: through which presets, of which node and topics, and in which
//! words.

use std::fmt::Display;

use ratelab::{Knob, KnobKind, Time, TimedKnob};
use ratelab_metrics::{NodeAccount, Snapshot, TopicAccount};
use ratelab_system::{
    Alias, KnobText, Setup, System,
    names::{first_alias, short, short_value},
    paced_node,
};

/// The keys that raise the rates of the first aliases.
pub const RATE_KEYS: [char; 2] = [']', '}'];

/// Rates in Hz: dense where the pole falls.
pub const RATES: [f64; 27] = [
    1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 12.0, 15.0, 20.0, 25.0, 30.0, 40.0, 50.0,
    60.0, 75.0, 100.0, 125.0, 150.0, 200.0, 250.0, 500.0, 750.0, 1000.0,
];

/// Presets for hands in a hurry: three presses from 5 to 50.
pub const COARSE_RATES: [f64; 8] = [1.0, 2.0, 5.0, 10.0, 25.0, 50.0, 100.0, 1000.0];

/// Queue depths in messages.
pub const DEPTHS: [f64; 10] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0];

/// Delays of a link (ms).
pub const DELAYS: [f64; 17] = [
    0.0, 5.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 90.0, 100.0, 120.0, 150.0, 200.0,
    300.0, 500.0,
];

/// Shares of messages that a link loses.
pub const LOSSES: [f64; 13] = [
    0.0, 0.01, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0,
];

/// Speeds of virtual time against wall time.
pub const SPEEDS: [f64; 10] = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0];

/// The direction in which a key moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// To the next higher preset.
    Up,
    /// To the next lower preset.
    Down,
}

/// Returns the preset next to `value`, which may itself lie between presets; `None` at the end of
/// them.
pub fn next(presets: &[f64], value: f64, direction: Direction) -> Option<f64> {
    match direction {
        Direction::Up => presets.iter().copied().find(|preset| *preset > value),
        Direction::Down => presets.iter().rev().copied().find(|preset| *preset < value),
    }
}

/// Returns the number next to `at` in a circle of `count`.
pub fn neighbour(at: Option<usize>, count: usize, direction: Direction) -> Option<usize> {
    let step = if direction == Direction::Up {
        1
    } else {
        count.checked_sub(1)?
    };
    (at.unwrap_or(0) + step).checked_rem(count)
}

/// Returns the notice that `what` has no preset beyond its `value`.
pub fn at_end(what: &str, direction: Direction, value: impl Display) -> String {
    let end = match direction {
        Direction::Up => "highest",
        Direction::Down => "lowest",
    };
    format!("{what} is at its {end}, {value}")
}

/// The node whose rate keys turn, and the topics whose depths they turn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct KnobFocus {
    /// Name of the node.
    pub node: String,
    /// Names of the topics.
    pub topics: Vec<String>,
}

impl KnobFocus {
    /// Creates the node and the topics of the first aliases of `system`; without aliases the node
    /// with the most connections, and all topics with readers.
    pub fn new(system: &dyn System, graph: &Snapshot) -> Self {
        let node = first_node(system, graph);
        Self {
            node: node.map_or_else(String::new, |node| node.name.to_string()),
            topics: first_topics(system, graph),
        }
    }

    /// Goes to the next node of `graph`, or the one before.
    pub fn move_node(&mut self, graph: &Snapshot, direction: Direction) {
        let names: Vec<&str> = graph.nodes.iter().map(|node| &*node.name).collect();
        let at = names.iter().position(|name| *name == self.node);
        if let Some(at) = neighbour(at, names.len(), direction) {
            names[at].clone_into(&mut self.node);
        }
    }

    /// Goes to the next topic of `graph` with readers, or the one before; after the
    /// last to the topics of the beginning.
    pub fn move_topic(&mut self, system: &dyn System, graph: &Snapshot, direction: Direction) {
        let first = first_topics(system, graph);
        let mut places: Vec<Vec<String>> = read(graph)
            .map(|topic| vec![topic.name.to_string()])
            .filter(|topics| *topics != first)
            .collect();
        places.insert(0, first);
        let at = places.iter().position(|topics| *topics == self.topics);
        if let Some(at) = neighbour(at, places.len(), direction) {
            self.topics = places.swap_remove(at);
        }
    }
}

/// Returns the node of the first alias for a rate; without one the node at a rate with the most
/// inputs and outputs, the plant last among equals.
pub fn first_node<'g>(system: &dyn System, graph: &'g Snapshot) -> Option<&'g NodeAccount> {
    if let Some(node) = paced_node(system).and_then(|name| graph.node(name)) {
        return Some(node);
    }
    let ends = |node: usize| {
        let ends = graph.topics.iter().flat_map(|topic| {
            let readers = topic.readers.iter().map(|reader| reader.node);
            topic.publishers.iter().copied().chain(readers)
        });
        ends.filter(|end| *end == node).count()
    };
    let states = system.states_topic().and_then(|name| graph.topic(name));
    let makes_states = |node| states.is_some_and(|topic| topic.publishers.contains(&node));
    graph
        .nodes
        .iter()
        .enumerate()
        .rev()
        .max_by_key(|(index, node)| {
            let paced = node.triggers.is_empty();
            (paced, ends(*index), !makes_states(*index))
        })
        .map(|(_, node)| node)
}

/// Returns the topics of the first alias for a depth; without one all topics with readers.
fn first_topics(system: &dyn System, graph: &Snapshot) -> Vec<String> {
    match first_alias(system, KnobKind::Depth) {
        Some(alias) => alias
            .knobs
            .iter()
            .map(|(_, name)| (*name).to_owned())
            .collect(),
        None => read(graph).map(|topic| topic.name.to_string()).collect(),
    }
}

fn read(graph: &Snapshot) -> impl Iterator<Item = &TopicAccount> {
    graph.topics.iter().filter(|topic| topic.is_read())
}

/// Returns the names that a knob of this `kind` may be of.
pub fn targets(graph: &Snapshot, kind: KnobKind) -> Vec<&str> {
    if kind.is_of_topic() {
        graph.topics.iter().map(|topic| &*topic.name).collect()
    } else {
        graph.nodes.iter().map(|node| &*node.name).collect()
    }
}

/// Returns the texts of `knobs`, by their aliases if they have one, each with its run time.
pub fn in_words(system: &dyn System, knobs: &[TimedKnob]) -> Vec<(Time, String)> {
    let mut words = Vec::new();
    for together in knobs.chunk_by(|a, b| a.at == b.at) {
        let shortened = together.iter().map(|timed| TimedKnob {
            at: timed.at,
            knob: with_message(&timed.knob, |node, text| short(system, node, text)),
        });
        let shortened: Vec<_> = shortened.collect();
        let lines = KnobText(system.knobs().aliases()).lines(&shortened);
        let texts = lines.iter().filter_map(|line| line.split_once(' '));
        words.extend(texts.map(|(_, text)| (together[0].at, text.to_owned())));
    }
    words
}

/// Returns the texts of `knobs` in a sentence.
pub fn listed(system: &dyn System, knobs: &[Knob]) -> String {
    let at = Time::ZERO;
    let knobs = knobs.iter().cloned().map(|knob| TimedKnob { at, knob });
    let words = in_words(system, &knobs.collect::<Vec<_>>()).into_iter();
    words.map(|(_, text)| text).collect::<Vec<_>>().join(", ")
}

/// Returns `alias` and its value in `setup`, such as `policy scripted`.
pub fn setting(system: &dyn System, alias: &Alias, setup: &Setup) -> String {
    format!("{} {}", alias.name, short_value(system, alias, setup))
}

/// Returns `knob`, with the `text` of its node and its message in place of the message.
pub fn with_message(knob: &Knob, text: impl Fn(&str, &str) -> String) -> Knob {
    match knob {
        Knob::Send { node, text: sent } => Knob::Send {
            node: node.clone(),
            text: text(node, sent),
        },
        other => other.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_between_presets_moves_to_its_neighbours_and_the_ends_lead_nowhere() {
        for (value, up, down) in [
            (7.5, Some(8.0), Some(7.0)),
            (1.0, Some(2.0), None),
            (5000.0, None, Some(1000.0)),
        ] {
            let found = [Direction::Up, Direction::Down].map(|to| next(&RATES, value, to));
            assert_eq!(found, [up, down]);
        }
    }

    #[test]
    fn presets_ascend() {
        for presets in [
            &RATES[..],
            &COARSE_RATES,
            &DEPTHS,
            &DELAYS,
            &LOSSES,
            &SPEEDS,
        ] {
            assert!(presets.is_sorted_by(|a, b| a < b));
        }
    }

    #[test]
    fn a_circle_is_gone_round_either_way() {
        assert_eq!(neighbour(Some(2), 3, Direction::Up), Some(0));
        assert_eq!(neighbour(Some(0), 3, Direction::Down), Some(2));
        assert_eq!(neighbour(None, 0, Direction::Up), None);
        assert_eq!(neighbour(None, 0, Direction::Down), None);
    }
}
