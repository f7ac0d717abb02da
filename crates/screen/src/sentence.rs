//! Sentences, and the numbers in them.

use ratelab::Topology;
pub use ratelab_experiment::millis::{ms, whole};
use ratelab_metrics::{AgeParts, AgeStage, nanos};

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
    use super::*;
    use ratelab_experiment::{Config, Experiment};
    use ratelab_metrics::AgePart;
    use ratelab_system::graph_file::GraphFile;
    use std::{sync::Arc, time::Duration};

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
