//! Runs a changed graph by every reading that the bag behind it leaves open.

use ratelab::{ClockKind, Interrupt};
use ratelab_experiment::{Config, Experiment, Summary};
use ratelab_system::graph_file::{doubted, readings};

use crate::{program::Program, summary::readings::OtherReadings};

/// The most readings that are run.
const MOST: usize = 12;

/// Runs `program` as `config` has it by each other reading, until `interrupt` is asked for. `None`
/// without a bag or a change, and on the real clock.
pub fn other_readings(
    program: &Program,
    config: &Config,
    interrupt: &Interrupt,
) -> Option<OtherReadings> {
    let about = program.system.about();
    let has_bag = about.chains.iter().any(|chain| chain.bag.is_some());
    let (before, now) = (program.unchanged.as_deref()?, about.graph_file?);
    if !has_bag || config.clock == ClockKind::Real {
        return None;
    }
    let mut all = OtherReadings::new(doubted(before, now));
    for reading in readings(before, now).into_iter().take(MOST) {
        if interrupt.is_asked() {
            break;
        }
        // The change may leave no graph by this reading: then it is left out.
        let read = program.with(&reading.with).ok().map(|read| read.system);
        let summary = read.as_ref().and_then(|system| -> Option<Summary> {
            let experiment = Experiment::new(system.clone(), config).ok()?;
            experiment.run_until(interrupt).ok()?
        });
        if let Some((system, summary)) = read.zip(summary) {
            all.add(&reading, system.about().chains, &summary);
        }
    }
    Some(all)
}
