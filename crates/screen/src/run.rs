//! What can be read of a run that is shown, and what a run of other processes can do besides.

use std::{sync::Arc, time::Duration};

use ratelab::Knob;
use ratelab_experiment::{Config, Summary};
use ratelab_metrics::{Lineage, Observer, Rows};
use ratelab_system::{Signal, System, plant};

use super::{frame::Place, sameness::RunDigest};

/// New messages of a watched topic, with its name.
pub type WatchedRows = (String, Rows);

/// Returns the topics whose every message is drawn: the topics of states, of the first signal and
/// of plans.
pub fn watched(system: &dyn System) -> impl Iterator<Item = String> {
    let state = system.state().map(str::to_owned);
    let signal = signal(system).map(|signal| signal.topic.into_owned());
    let signal = signal.filter(|topic| Some(topic) != state.as_ref());
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
    let of_chains = signal(system).is_some_and(|signal| system.chains() == Some(&*signal.topic));
    of_chains && plant(system).is_none()
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
