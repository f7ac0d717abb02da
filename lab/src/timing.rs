//! The configured timing of nodes.

use std::{sync::Arc, time::Duration};

use ratelab::{Knob, KnobKind};
use ratelab_account::NodeAccount;
use ratelab_study::{
    experiment::{Config, Experiment, Summary},
    system::{System, WorldKind},
};

/// Whether `knob` sets the duration, lateness or offset of a node's ticks.
pub fn is_of_time(knob: &Knob) -> bool {
    matches!(
        knob.kind(),
        KnobKind::Takes | KnobKind::Offset | KnobKind::Wakes
    )
}

/// Whether the effect of `knob` depends on the world: a cost, a link or a fault has less
/// effect in a world that waits.
pub fn depends_on_the_world(knob: &Knob) -> bool {
    !matches!(
        knob.kind(),
        KnobKind::Rate | KnobKind::Depth | KnobKind::Send | KnobKind::Read
    )
}

/// Whether the timing of `node` was configured at any time of a run.
pub fn is_timed(summary: &Summary, node: &str) -> bool {
    knobs(summary).any(|knob| is_of_time(&knob) && knob.target() == node)
}

/// Whether a tick of `node` began after it was due.
pub fn was_late(node: &NodeAccount) -> bool {
    node.lateness.max() > Some(Duration::ZERO)
}

/// The knobs turned before and during a run.
fn knobs(summary: &Summary) -> impl Iterator<Item = Knob> {
    let before = summary.config.setup.iter().cloned();
    let turned = summary.knobs().into_iter().map(|timed| timed.knob);
    before.chain(turned)
}

/// A description of a run's world, if it moves by itself or if a turned knob depends on
/// it.
pub fn world(system: &dyn System, summary: &Summary) -> Option<String> {
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

/// The topic of the states of a plant; `None` for a graph around data only.
pub fn plant(system: &dyn System) -> Option<&'static str> {
    let state = system.state();
    state.filter(|state| Some(*state) != system.chains())
}

/// A world that moves by itself for a run of `system`: that of `config`, or one with the
/// default step; `None` if the system has none.
pub fn own_world(system: &Arc<dyn System>, config: &Config) -> Option<WorldKind> {
    if !config.world.is_course() {
        return Some(config.world);
    }
    let own = Config {
        world: WorldKind::OWN,
        ..config.clone()
    };
    let built = Experiment::new(system.clone(), &own);
    built.is_ok().then_some(WorldKind::OWN)
}
