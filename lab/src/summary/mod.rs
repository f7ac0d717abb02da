//! The summary of a run, as text and as JSON. A new figure is a row in each.

pub mod ages;
mod bag;
pub mod json;
pub mod readings;
pub mod text;

use std::time::Duration;

use ratelab::{Knob, KnobKind};
use ratelab_experiment::Summary;
use ratelab_metrics::NodeAccount;
use ratelab_system::{System, WorldKind, depends_on_the_world, plant_topic};

/// How many digits the figures of a run have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Digits {
    /// Four decimals, for readers.
    Four,
    /// All that were measured, to be compared with limits.
    All,
}

impl Digits {
    /// Returns `value` with so many digits.
    pub fn round(self, value: f64) -> f64 {
        match self {
            Self::Four => rounded(value),
            Self::All => value,
        }
    }

    /// This number of seconds in milliseconds.
    pub fn ms(self, seconds: f64) -> f64 {
        match self {
            Self::Four => rounded(seconds * 1e3),
            // By way of nanoseconds, which are whole: fewer last digits are noise.
            Self::All => seconds * 1e9 / 1e6,
        }
    }
}

/// Rounds to four decimals, as in the course's artifact.
pub fn rounded(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

/// Returns whether the duration, lateness or offset of the ticks of `node` was set at any time of a
/// run; a hang is of one tick only.
pub fn has_set_times(summary: &Summary, node: &str) -> bool {
    let sets_time = |kind: KnobKind| kind.is_time() && kind != KnobKind::Hang;
    knobs(summary).any(|knob| sets_time(knob.kind()) && knob.target() == node)
}

/// Returns whether a tick of `node` began after it was due.
pub fn was_late(node: &NodeAccount) -> bool {
    node.lateness.max() > Some(Duration::ZERO)
}

/// Returns the knobs turned before and during a run.
fn knobs(summary: &Summary) -> impl Iterator<Item = Knob> {
    let before = summary.config.setup.iter().cloned();
    let turned = summary.knobs().into_iter().map(|timed| timed.knob);
    before.chain(turned)
}

/// Returns a description of a run's world, if it moves by itself or if a turned knob depends on it.
pub fn world(system: &dyn System, summary: &Summary) -> Option<String> {
    if let Some(plant) = system.about().plant {
        return Some(format!(
            "own: the plant moves by itself, in steps of {} ms",
            plant.step_ms
        ));
    }
    match summary.config.world {
        WorldKind::Own { step_ms } => Some(format!(
            "own: the plant moves by itself, in steps of {} ms",
            step_ms.get()
        )),
        WorldKind::Course => {
            plant_topic(system)?;
            knobs(summary).find(depends_on_the_world)?;
            Some("course: it waits for the actuator, whatever is late or lost".to_owned())
        }
    }
}
