//! The configured timing of nodes.

use std::time::Duration;

use ratelab::{Knob, KnobKind};
use ratelab_experiment::Summary;
use ratelab_metrics::NodeAccount;
use ratelab_system::{System, WorldKind, depends_on_the_world, plant};

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
            plant(system)?;
            knobs(summary).find(depends_on_the_world)?;
            Some("course: it waits for the actuator, whatever is late or lost".to_owned())
        }
    }
}
