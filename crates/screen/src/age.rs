//! The push age of a frame, its parts, and the sentence about them.

use std::time::Duration;

use ratelab::Topology;
use ratelab_metrics::{AgeParts, AgeStage, nanos};

pub use ratelab_experiment::{
    cause::{AgeData, Strain},
    millis::{ms, whole},
};

/// The parts of the age of the push in force.
#[derive(Clone, Debug, PartialEq)]
pub struct PushData {
    /// The current parts.
    pub sentence: PushSentence,
    /// The greatest reaction time lately.
    pub reaction: Option<Duration>,
    /// The recent mean of each of [`PARTS`].
    pub mean: [Duration; PARTS.len()],
}

/// What data do at the stages of an age, in order of occurrence: the glyph in the bar, and the
/// [word](ratelab_metrics::AgeStage::word).
pub const PARTS: [[&str; 2]; 5] = [
    ["?", UNKNOWN],
    ["▒", "waited"],
    ["█", "worked"],
    ["▄", "on links"],
    ["▓", "held"],
];

/// The word of a part of the chain that is not known.
pub const UNKNOWN: &str = "unknown";

/// The parts of an age in a sentence, whole and with the smallest parts merged.
#[derive(Clone, Debug, PartialEq)]
pub struct PushSentence(pub Vec<String>);

impl PushSentence {
    /// The parts that have no room in a line: the key i has them.
    const MORE: &str = "more (i)";

    /// Widths of the sentence (columns).
    const WIDTHS: [usize; 5] = [usize::MAX, 78, 64, 52, 38];

    /// Creates the sentence about `parts`.
    pub fn new(parts: &AgeParts, topology: &Topology) -> Self {
        let within = |room| sentence(parts, topology, room, Self::MORE);
        Self(Self::WIDTHS.map(within).into())
    }

    /// Returns the whole sentence.
    pub fn whole(&self) -> &str {
        self.0.first().map_or("", String::as_str)
    }

    /// Returns the longest one for which `fits` is true, or else the shortest.
    pub fn fitting(&self, fits: impl Fn(&str) -> bool) -> &str {
        let fitting = self.0.iter().find(|text| fits(text));
        fitting.or(self.0.last()).map_or("", String::as_str)
    }
}

/// Returns an age in a sentence of at most `room` characters, where possible, such as
/// `this push is 180 ms old: 20 waiting for the policy + 31 thinking + 12 on /action + 117 held`:
/// whole milliseconds, which sum to the age. Where it has no room the smallest parts are added up,
/// and are called `more`.
pub fn sentence(parts: &AgeParts, topology: &Topology, room: usize, more: &str) -> String {
    let age = (parts.sum_ns() as f64 / 1e6).round() as i64;
    let (mut parts, mut rest, mut words) = (in_words(parts, topology), 0, AgeStage::Before.word());
    // Less than nothing is the error of a clock, or a tick that is not known (yet).
    parts.retain(|(ms, _)| {
        rest += (*ms).min(0);
        *ms > 0
    });
    loop {
        let last = (rest != 0).then(|| (rest, words.to_owned()));
        let mut sentence = format!("this push is {age} ms old");
        for (number, (ms, words)) in parts.iter().chain(&last).enumerate() {
            let sign = if number == 0 { ": " } else { " + " };
            sentence += &format!("{sign}{ms} {words}");
        }
        let smallest = (0..parts.len()).min_by_key(|index| parts[*index].0.abs());
        let has_room = sentence.chars().count() <= room;
        let Some(smallest) = smallest.filter(|_| parts.len() > 1 && (rest < 0 || !has_room)) else {
            return sentence;
        };
        // Only what has no room can be read in full elsewhere.
        if !has_room {
            words = more;
        }
        rest += parts.remove(smallest).0;
    }
}

/// Returns the parts of a millisecond or more, with their descriptions.
fn in_words(parts: &AgeParts, topology: &Topology) -> Vec<(i64, String)> {
    let mut words: Vec<(i64, String)> = Vec::new();
    let costs = parts
        .parts
        .iter()
        .filter(|part| matches!(part.stage, AgeStage::Cost(_)));
    let alone = costs.count() == 1;
    let before = Some((parts.before_ns, AgeStage::Before.phrase().to_owned()));
    let told = parts.parts.iter().map(|part| {
        let name = words_of(part.stage, topology, alone);
        (nanos(part.took), name)
    });
    for (nanos, name) in before.into_iter().chain(told) {
        match words.last_mut().filter(|(_, last)| *last == name) {
            Some((sum, _)) => *sum += nanos,
            None => words.push((nanos, name)),
        }
    }
    // Rounded as running sums: their sum is the rounded age.
    let (mut sum, mut shown) = (0, 0);
    for (nanos, _) in &mut words {
        sum += *nanos;
        let until = (sum as f64 / 1e6).round() as i64;
        *nanos = until - shown;
        shown = until;
    }
    words.retain(|(ms, _)| *ms != 0);
    words
}

/// Returns the description of a stage, to follow a number of milliseconds; `alone` if no other tick
/// in the chain has a duration.
fn words_of(stage: AgeStage, topology: &Topology, alone: bool) -> String {
    match stage {
        AgeStage::Cost(node) if alone && thinks(topology, node) => "thinking".to_owned(),
        _ => stage.phrase().replace("{}", stage.owner(topology)),
    }
}

/// Returns whether a node has both inputs and outputs.
fn thinks(topology: &Topology, node: usize) -> bool {
    let mut topics = topology.topics.iter();
    let reads = topics.clone().any(|topic| topic.readers.contains(&node));
    reads && topics.any(|topic| topic.publishers.contains(&node))
}

#[cfg(test)]
mod tests {
    use std::{sync::Arc, time::Duration};

    use ratelab_experiment::{Config, Experiment};
    use ratelab_metrics::{AgePart, AgeStage};
    use ratelab_system::graph_file::GraphFile;

    use super::{PARTS, *};

    #[test]
    fn every_stage_of_an_age_has_a_glyph() {
        for stage in [
            AgeStage::Before,
            AgeStage::Wait(0),
            AgeStage::Match { topic: 0, node: 0 },
            AgeStage::Executor(0),
            AgeStage::Queue(0),
            AgeStage::Reuse(0),
            AgeStage::Cost(0),
            AgeStage::Link(0),
            AgeStage::Held(0),
            AgeStage::Kept(0),
        ] {
            assert!(
                PARTS.iter().any(|[_, word]| *word == stage.word()),
                "{stage:?}"
            );
        }
    }

    const STEREO: &str = "
name = 'stereo'
node.left = { rate = 10, publishes = ['/left'] }
node.right = { rate = 10, publishes = ['/right'] }
node.stereo = { trigger = ['/left', '/right'], match = 'exact:2', publishes = ['/pair'] }
";

    #[test]
    fn the_smallest_parts_go_together_where_there_is_no_room() {
        let file = GraphFile::parse(STEREO).expect("a graph");
        let system = Arc::new(file.system(&[]).expect("a system"));
        let experiment = Experiment::new(system, &Config::default()).expect("a graph");
        let topology = experiment.observer().topology();
        let node = |name| topology.node(name).expect("a node");
        let stereo = node("stereo");
        let matched = AgeStage::Match {
            topic: topology.topic("/right").expect("a topic"),
            node: stereo,
        };
        let parts = [
            (AgeStage::Cost(node("left")), 5),
            (matched, 25),
            (AgeStage::Executor(stereo), 10),
            (AgeStage::Cost(stereo), 8),
        ]
        .map(|(stage, ms)| AgePart {
            stage,
            took: Duration::from_millis(ms),
        });
        let parts = AgeParts {
            parts: parts.to_vec(),
            before_ns: 0,
        };
        assert_eq!(
            sentence(&parts, &topology, usize::MAX, ""),
            "this push is 48 ms old: 5 in the left + 25 waiting for /right to match + 10 waiting for \
     the executor of the stereo + 8 in the stereo"
        );
        assert_eq!(
            sentence(&parts, &topology, 70, "more"),
            "this push is 48 ms old: 25 waiting for /right to match + 23 more"
        );
    }
}
