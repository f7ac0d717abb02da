//! An age in a sentence.

use ratelab::Topology;

use super::parts::{AgeParts, AgeStage, nanos};

/// The time before the first known tick, in words.
const BEFORE: &str = "before the first tick";

/// What no known tick or message explains, in words.
const UNKNOWN: &str = "unknown";

impl AgeParts {
    /// The age in a sentence, such as `this push is 180 ms old: 20 waiting for the
    /// policy + 31 thinking + 12 on /action + 117 held`. Whole milliseconds, which
    /// sum to the age.
    pub fn sentence(&self, topology: &Topology) -> String {
        self.sentence_within(topology, usize::MAX, "")
    }

    /// A sentence of at most `room` characters, where possible: the smallest parts are added up,
    /// and are called `more`.
    pub fn sentence_within(&self, topology: &Topology, room: usize, more: &str) -> String {
        let age = (self.sum_ns() as f64 / 1e6).round() as i64;
        let (mut parts, mut rest, mut words) = (self.in_words(topology), 0, UNKNOWN);
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
            let Some(smallest) = smallest.filter(|_| parts.len() > 1 && (rest < 0 || !has_room))
            else {
                return sentence;
            };
            // Only what has no room can be read in full elsewhere.
            if !has_room {
                words = more;
            }
            rest += parts.remove(smallest).0;
        }
    }

    /// The parts of a millisecond or more, with their descriptions.
    fn in_words(&self, topology: &Topology) -> Vec<(i64, String)> {
        let mut words: Vec<(i64, String)> = Vec::new();
        let costs = self.parts.iter();
        let costs = costs.filter(|part| matches!(part.stage, AgeStage::Cost { .. }));
        let alone = costs.count() == 1;
        let before = Some((self.before_ns, BEFORE.to_owned()));
        let parts = self.parts.iter().map(|part| {
            let name = part.stage.words(topology, alone);
            (nanos(part.took), name)
        });
        for (nanos, name) in before.into_iter().chain(parts) {
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
}

impl AgeStage {
    /// Its description, to follow a number of milliseconds; `alone` if no other tick in
    /// the chain has a duration.
    fn words(self, topology: &Topology, alone: bool) -> String {
        let owner = self.owner(topology);
        match self {
            Self::Before => BEFORE.to_owned(),
            Self::Wait { .. } => format!("waiting for the {owner}"),
            Self::Match { .. } => format!("waiting for {owner} to match"),
            Self::Executor { .. } => format!("waiting for the executor of the {owner}"),
            Self::Queue { .. } => format!("in the queue of {owner}"),
            Self::Reuse { .. } => format!("until {owner} was read again"),
            Self::Cost { node } if alone && thinks(topology, node) => "thinking".to_owned(),
            Self::Cost { .. } => format!("in the {owner}"),
            Self::Link { .. } => format!("on {owner}"),
            Self::Held { .. } | Self::Kept { .. } => "held".to_owned(),
        }
    }
}

/// Whether a node has both inputs and outputs.
fn thinks(topology: &Topology, node: usize) -> bool {
    let mut topics = topology.topics.iter();
    let reads = topics.clone().any(|topic| topic.readers.contains(&node));
    reads && topics.any(|topic| topic.publishers.contains(&node))
}
