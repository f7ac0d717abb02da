//! What was asked of the time that nodes take.

use std::sync::Arc;

use ratelab::{
    experiment::{Config, Experiment, Summary},
    runtime::{Knob, KnobKind},
    system::{System, WorldKind},
};

/// Whether `knob` gives the ticks of a node a time of their own: they take, are late
/// or are shifted.
pub fn is_of_time(knob: &Knob) -> bool {
    matches!(
        knob.kind(),
        KnobKind::Takes | KnobKind::Offset | KnobKind::Wakes
    )
}

/// Whether the ticks of `node` were given a time of their own at any time of a run.
pub fn is_timed(summary: &Summary, node: &str) -> bool {
    knobs_of_time(summary).any(|knob| knob.target() == node)
}

fn knobs_of_time(summary: &Summary) -> impl Iterator<Item = Knob> {
    let before = summary.config.setup.iter().cloned();
    let turned = summary.knobs().into_iter().map(|timed| timed.knob);
    before.chain(turned).filter(is_of_time)
}

/// What is to be known of the world of a run, if it is one of its own, or ticks were
/// given a time of their own.
pub fn world(system: &dyn System, summary: &Summary) -> Option<String> {
    match summary.config.world {
        WorldKind::Own { step_ms } => Some(format!(
            "own: the plant moves by itself, in steps of {} ms",
            step_ms.get()
        )),
        WorldKind::Course => {
            system.state()?;
            knobs_of_time(summary).next()?;
            Some("course: it waits for the actuator, whatever ticks take".to_owned())
        }
    }
}

/// The world of its own in which a run of `system` can be: that of `config`, or one of
/// the usual steps; `None` if the system has none.
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
