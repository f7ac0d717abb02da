//! A branch of a run, as a session.

use std::sync::Arc;

use ratelab::{Speed, Time};
use ratelab_study::system::KnobText;

use super::session::{Prepared, SessionSetup};
use crate::{
    change::Change,
    recording::{Departure, Recording, branch},
};

/// A branch, and the run that it left.
pub struct LeftRun {
    /// That run.
    pub recording: Arc<Recording>,
    /// Run time at which it was to be left.
    pub asked: Time,
    /// The change.
    pub change: Change,
}

/// A branch ready to begin, and the run that it leaves.
pub type PreparedBranch = (Prepared, LeftRun);

/// Prepares a session that leaves `recording` at run time `at` with the knobs in `text`,
/// and goes on at `speed` until `end`, or for some seconds if it is left there.
///
/// # Errors
/// Why this is impossible.
pub fn prepare(
    recording: &Arc<Recording>,
    setup: &SessionSetup,
    (at, text): (Time, &str),
    (end, speed): (Time, Speed),
) -> Result<PreparedBranch, String> {
    let knobs = KnobText(setup.system.aliases()).parse(text);
    let departure = Departure {
        at,
        knobs: knobs.map_err(|error| error.to_string())?,
        end: Some(end).filter(|end| *end > at),
        speed,
    };
    let branch = branch(recording, &setup.system, &departure);
    let branch = branch.map_err(|error| error.to_string())?;
    let left = LeftRun {
        change: Change::new(recording, &*setup.system, branch.at, text.to_owned()),
        asked: at,
        recording: recording.clone(),
    };
    let prepared = Prepared::of_branch(branch, setup).map_err(|error| error.to_string())?;
    Ok((prepared, left))
}
