//! The order of the threads of a run that was under the real clock.

use ratelab::{ClockKind, Command, Event};
use ratelab_re_execution::ReExecution;
use ratelab_system::System;

use super::{VerifyError, events};
use crate::run::Recording;

/// Prepares to execute a recorded run again as far as it was under the real clock; `None`
/// if it never was.
///
/// # Errors
/// [`VerifyError`] if its log is missing or wrong.
pub fn re_execution(
    recording: &Recording,
    system: &dyn System,
) -> Result<Option<ReExecution>, VerifyError> {
    let Some(when) = under_the_real_clock(recording) else {
        return Ok(None);
    };
    let Some(threads) = &recording.threads else {
        return Err(VerifyError::RealClock(when));
    };
    if let Some(damage) = threads.damage {
        return Err(VerifyError::Log(damage));
    }
    let topology = &recording.origin.topology;
    let read = if is_whole(recording) {
        ReExecution::new
    } else {
        ReExecution::from_torn
    };
    let mut re_execution = read(&threads.log, &threads.events, topology)?;
    re_execution.expect_refusals(|command| events::names_a_file(system, command));
    for command in re_execution.commands_mut() {
        events::load_table(command)?;
    }
    Ok(Some(re_execution))
}

/// Returns whether the log goes on to the end of the run.
pub fn is_whole(recording: &Recording) -> bool {
    let threads = recording.threads.as_ref();
    let full = threads.is_some_and(|threads| threads.log.is_full());
    recording.is_whole() && recording.end_of_run().is_some() && !full
}

/// Returns when a run was under the real clock.
fn under_the_real_clock(recording: &Recording) -> Option<&'static str> {
    let handed_over =
        |event: &Event| matches!(event.applied(), Some(Command::HandOver(ClockKind::Real)));
    match recording.origin.config.clock {
        ClockKind::Real => Some("begun"),
        _ if recording.events.iter().any(handed_over) => Some("for a while"),
        _ => None,
    }
}
