//! The judgement of a rescue by hand from its recording.

use std::path::Path;

use exercises::rescue::judge::{RescueFailure, RescueSession, Rescued, judge};
use ratelab::{
    cartpole::{CartPole, ControlStep, POLICY, STATE, actuator_hz, verdict},
    runtime::{Message, TimedKnob, telemetry::Event},
    system::Verdict,
};

use crate::recording::{ReadError, Recording, schema::RunStatus};

/// Number of the exercise with a rescue by hand.
pub const RESCUE: u32 = 5;

/// The commands of the rescue included with ratelab, `recordings/rescued.rrd`.
const SHIPPED: &str = include_str!("../../recordings/rescue.knobs");

/// Whether `recording` is the rescue included with ratelab, or one by the same commands:
/// nobody turns two knobs at the same nanoseconds again, so a copy in another file, a part
/// of it and a repetition of it are all recognized.
pub fn is_shipped(recording: &Recording) -> bool {
    let shipped = CartPole::KNOBS.parse_list(SHIPPED).unwrap_or_default();
    let commands: Vec<TimedKnob> = recording.events.iter().filter_map(Event::knob).collect();
    !shipped.is_empty() && shipped.iter().all(|command| commands.contains(command))
}

/// Judges the session in `file`; returns whether it is a rescue, with a text.
///
/// # Errors
/// [`ReadError`] if the file is no recording.
pub fn judge_file(file: &Path) -> Result<(bool, String), ReadError> {
    let recording = Recording::read(file)?;
    Ok(accept(&recording))
}

/// Whether `recording` is a rescue of the learner's own, with a text.
pub fn accept(recording: &Recording) -> (bool, String) {
    match judge_recording(recording) {
        Ok(rescued) if is_shipped(recording) => (
            false,
            format!("comes with ratelab, record your own ({rescued})"),
        ),
        Ok(rescued) => (true, rescued.to_string()),
        Err(failure) => (false, format!("not a rescue yet: {failure}")),
    }
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
