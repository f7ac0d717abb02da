//! The judgement of a rescue by hand from its recording.

use std::{fs, path::Path};

use exercises::rescue::judge::{RescueFailure, RescueSession, Rescued, judge};
use ratelab::{
    cartpole::{CartPole, ControlStep, POLICY, STATE, actuator_hz, verdict},
    policy::Digest,
    runtime::Message,
    system::Verdict,
};

use crate::recording::{ReadError, Recording, schema::RunStatus};

/// Number of the exercise with a rescue by hand.
pub const RESCUE: u32 = 5;

/// SHA-256 of `recordings/rescued.rrd`, the rescue included with ratelab.
const SHIPPED: &str = "31d8c013b119cd0b59ebd8d9c44c0f6f5421f27416028c42b3cf0253ca7661dd";

/// Whether `file` is the rescue included with ratelab.
pub fn is_shipped(file: &Path) -> bool {
    let content = fs::read(file).unwrap_or_default();
    Digest::of(&content).to_string() == SHIPPED
}

/// Judges the session in `file`; returns whether it is a rescue, with a text.
///
/// # Errors
/// [`ReadError`] if the file is no recording.
pub fn judge_file(file: &Path) -> Result<(bool, String), ReadError> {
    let recording = Recording::read(file)?;
    Ok(match judge_recording(&recording) {
        Ok(rescued) => (true, rescued.to_string()),
        Err(failure) => (false, failure.to_string()),
    })
}

/// Judges the session in `recording`.
///
/// # Errors
/// The reason if it is no rescue.
pub fn judge_recording(recording: &Recording) -> Result<Rescued, RescueFailure> {
    let steps: Vec<Message<ControlStep>> = recording.messages(STATE);
    let system = CartPole::default();
    let verdict = match recording.outcome.as_ref().map(|outcome| &outcome.end) {
        Some(RunStatus::Ended(end)) => end.verdict.verdict(&system),
        _ => Verdict::new(&verdict::STOPPED, recording.until),
    };
    let control_hz = recording.origin.config.setup.rate(POLICY);
    judge(&RescueSession {
        control_hz: control_hz.unwrap_or(actuator_hz()),
        events: &recording.events,
        steps: &steps,
        verdict,
    })
}
