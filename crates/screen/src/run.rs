//! What can be read of a run that is shown, and whether two runs are the same.

use std::{
    hash::{DefaultHasher, Hash, Hasher},
    sync::Arc,
    time::Duration,
};

use ratelab::{Head, Knob};
use ratelab_experiment::{Config, Summary};
use ratelab_metrics::{Lineage, Observer, Rows, TickRecord};
use ratelab_system::{Signal, System, plant_topic};

use crate::frame::Place;

/// New messages of a watched topic, with its name.
pub type WatchedRows = (String, Rows);

/// Returns the topics whose every message is drawn: the topics of states, of the first signal and
/// of plans.
pub fn watched(system: &dyn System) -> impl Iterator<Item = String> {
    let state = system.states_topic().map(str::to_owned);
    let signal = signal(system)
        .map(|signal| signal.topic.into_owned())
        .filter(|topic| Some(topic) != state.as_ref());
    let plans = system
        .robot()
        .planning()
        .map(|planning| planning.topics().map(str::to_owned));
    state
        .into_iter()
        .chain(signal)
        .chain(plans.into_iter().flatten())
}

/// Returns the plotted signal.
pub fn signal(system: &dyn System) -> Option<Signal> {
    system.signals().into_iter().next()
}

/// Returns whether the plotted signal is the push age itself: in a graph around data only.
pub fn signal_is_push_age(system: &dyn System) -> bool {
    let of_chains =
        signal(system).is_some_and(|signal| system.chains_topic() == Some(&*signal.topic));
    of_chains && plant_topic(system).is_none()
}

/// What can be read of a run.
pub trait RunSource {
    /// Returns the system.
    fn shared_system(&self) -> &Arc<dyn System>;

    /// Returns the system, as a reference.
    fn system(&self) -> &dyn System {
        &**self.shared_system()
    }

    /// Returns the configuration at the start.
    fn config(&self) -> &Config;

    /// Reads the graph.
    fn observer(&self) -> &Observer;

    /// Wall time since the beginning, or of the whole run.
    fn wall_time(&self) -> Duration;

    /// Returns the chains behind its actions, as of the last update.
    fn lineage(&self) -> &Lineage;

    /// Brings these chains up to now.
    fn update_lineage(&mut self) {}

    /// Returns the digest of the run so far, if it is to be compared with another run.
    fn digest(&self) -> Option<&RunDigest> {
        None
    }

    /// Returns the messages on the [`watched`] topics since the last call.
    fn new_rows(&mut self) -> Vec<WatchedRows>;

    /// Returns the number of messages lost because the dashboard was too slow.
    fn lost(&self) -> u64;

    /// Returns the summary, once the run is over.
    fn summary(&self) -> Option<&Summary>;

    /// Returns the process in which the node called `node` runs, if that is another one.
    fn place(&self, node: &str) -> Option<Place> {
        let _ = node;
        None
    }

    /// Returns whether its knobs can be turned.
    fn live(&self) -> bool {
        true
    }

    /// Returns whether it is at rest.
    fn at_rest(&self) -> bool {
        self.observer().status().paused || self.summary().is_some()
    }

    /// Returns what the top line says of it.
    fn status(&self) -> StatusExtra;
}

/// Additional parts of the top line.
#[derive(Clone, Debug, Default)]
pub struct StatusExtra {
    /// Number of the visible frame, from one, and the number of frames; `None` for the
    /// newest.
    pub back: Option<(usize, usize)>,
    /// Whether the run is over.
    pub ended: bool,
    /// Number of items lost by the running recording; `None` without a recording.
    pub recording: Option<u64>,
    /// Whether this is the replay of a recording.
    pub replay: bool,
    /// How exact ages across machines are, unless they are exact.
    pub clocks: Option<String>,
    /// What is wrong with the connection to other processes.
    pub trouble: Option<String>,
}

/// A run of other processes.
pub trait Remote: RunSource {
    /// Takes what has come; returns whether another run began.
    fn update(&mut self) -> bool;

    /// Asks for a knob to be turned.
    fn turn(&mut self, knob: Knob);

    /// Records the run from now on, or ends the recording; returns a notice.
    fn record(&mut self) -> String;

    /// Returns the last refusal of a knob since the last call.
    fn refusal(&mut self) -> Option<String>;
}

/// Maximum number of digests per topic or node.
const MAX_DIGESTS: usize = 1 << 20;

/// Running digests of a run: one after each message and each tick, so that any beginning
/// of a run can be compared with the same beginning of another one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunDigest {
    topics: Vec<Vec<u64>>,
    nodes: Vec<Vec<u64>>,
}

impl RunDigest {
    /// Adds a message of the topic with index `topic`, bit for bit.
    pub fn message(&mut self, topic: usize, head: &Head, row: &[f64]) {
        let bits = row.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        let head = (
            head.stamp,
            head.seq,
            head.origin,
            head.arrives,
            head.dropped,
        );
        add(place(&mut self.topics, topic), (head, bits));
    }

    /// Adds a tick of the node with index `node`, without its wall time.
    pub fn tick(&mut self, node: usize, tick: &TickRecord) {
        let tick = (
            tick.number,
            tick.at,
            tick.ends,
            tick.lateness,
            tick.overruns,
        );
        add(place(&mut self.nodes, node), tick);
    }

    /// Returns whether this run equals `other` up to the end of the shorter one; `whole` if both
    /// must have the same length.
    pub fn is_same(&self, other: &Self, whole: bool) -> bool {
        let topics = self.topics.iter().zip(&other.topics);
        let mut pairs = topics.chain(self.nodes.iter().zip(&other.nodes));
        let alike = |(one, other): (&Vec<u64>, &Vec<u64>)| {
            let both = one.len().min(other.len());
            let same = one[..both].last() == other[..both].last();
            same && (!whole || one.len() == other.len())
        };
        !self.topics.is_empty() && pairs.all(alike)
    }
}

fn place(series: &mut Vec<Vec<u64>>, index: usize) -> &mut Vec<u64> {
    if series.len() <= index {
        series.resize(index + 1, Vec::new());
    }
    &mut series[index]
}

fn add(digests: &mut Vec<u64>, item: impl Hash) {
    if digests.len() == MAX_DIGESTS {
        return;
    }
    let mut hasher = DefaultHasher::new();
    digests.last().hash(&mut hasher);
    item.hash(&mut hasher);
    digests.push(hasher.finish());
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::sample::head;
    use ratelab::Time;

    fn digest(values: &[f64]) -> RunDigest {
        let mut digest = RunDigest::default();
        for (seq, value) in (0..).zip(values) {
            digest.message(0, &head(seq, Time::from_nanos(seq), None), &[*value]);
        }
        digest
    }

    #[test]
    fn a_run_is_the_same_if_every_bit_is() {
        let run = digest(&[1.0, 0.0, 3.0]);
        assert!(run.is_same(&digest(&[1.0, 0.0, 3.0]), true));
        assert!(!run.is_same(&digest(&[1.0, -0.0, 3.0]), true));
        assert!(!run.is_same(&digest(&[1.0, -0.0]), false));
        assert!(run.is_same(&digest(&[1.0, 0.0]), false));
        assert!(!run.is_same(&digest(&[1.0, 0.0]), true));
        assert!(!RunDigest::default().is_same(&run, false));
    }
}
