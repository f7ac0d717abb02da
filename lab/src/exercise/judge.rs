//! A rescue by hand, judged from what was recorded of it.

use std::{fs, path::Path};

use exercises::{
    framework::Exercise,
    rescue::judge::{RescueFailure, RescueSession, Rescued, judge},
};
use ratelab::{
    cartpole::ControlStep,
    experiment::{STATE, Verdict},
    policy::Digest,
    runtime::Message,
};

use crate::{
    error::Error,
    output::print_line,
    recording::{ReadError, Recording, schema::RunStatus},
    review::defect,
};

/// Number of the exercise that is done by hand.
pub const RESCUE: u32 = 5;

/// SHA-256 of `recordings/rescued.rrd`, a rescue that everybody has.
const SHIPPED: &str = "31d8c013b119cd0b59ebd8d9c44c0f6f5421f27416028c42b3cf0253ca7661dd";

/// Judges the session in `file`, and prints the verdict.
pub fn judge_command(exercise: &dyn Exercise, file: &Path) -> Result<(), Error> {
    let brief = exercise.brief();
    if brief.number != RESCUE {
        return Err(Error::BadInput(format!(
            "--session is for exercise {RESCUE}: {} is not done in a session",
            brief.title
        )));
    }
    let recording = Recording::read(file)?;
    let name = file.display();
    let refused = match judge_recording(&recording) {
        Ok(rescued) if is_shipped(file) => {
            format!("comes with ratelab, record your own ({rescued})")
        }
        Ok(rescued) => {
            print_line(&format!("✓ {name}: {rescued}"))?;
            return defect(&recording);
        }
        Err(failure) => format!("not a rescue yet: {failure}"),
    };
    print_line(&format!("✖ {name}: {refused}"))?;
    Err(Error::NotRescued(name.to_string()))
}

fn is_shipped(file: &Path) -> bool {
    let content = fs::read(file).unwrap_or_default();
    Digest::of(&content).to_string() == SHIPPED
}

/// Judges the session in `file`; in words, and whether it is a rescue.
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

fn judge_recording(recording: &Recording) -> Result<Rescued, RescueFailure> {
    let steps: Vec<Message<ControlStep>> = recording.messages(STATE);
    let verdict = match recording.outcome.as_ref().map(|outcome| &outcome.end) {
        Some(RunStatus::Ended(end)) => end.verdict,
        _ => Verdict::Stopped {
            at: recording.until,
        },
    };
    judge(&RescueSession {
        control_hz: recording.origin.config.control_hz,
        events: &recording.events,
        steps: &steps,
        verdict,
    })
}
