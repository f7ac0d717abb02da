//! The recording of a rescue: whether it is one, verified bit for bit, and the learner's
//! own.

use std::{
    ops::ControlFlow,
    path::{Path, PathBuf},
};

use exercises::rescue::session::{is_shipped, judge_recording};
use ratelab::{ClockKind, Command, Event, Speed, Time, TimedKnob};
use ratelab_recording::{Recording, VerifyWith, verify};

use super::{Flags, file_name};
use crate::program::Program;

/// A recording that was handed in.
#[derive(Default)]
pub struct GradedRun {
    /// The file.
    pub file: PathBuf,
    /// The rescue, as text, if it is one.
    pub rescued: Option<String>,
    /// What was compared bit for bit, as text, if the run was repeated without a difference.
    pub verified: Option<String>,
    /// Why it is not acceptable; empty if it is.
    pub refused: Vec<String>,
    /// The commands of the learner, in order. On the virtual clock they and their run times,
    /// in nanoseconds, are the whole of what a person adds to a run.
    pub commands: Vec<TimedKnob>,
    /// Whether commands were in the settings of the run, so that no hand gave them.
    pub scripted: bool,
    /// What to look at.
    pub flags: Flags,
}

impl GradedRun {
    /// Judges and verifies the recording in `file`.
    pub fn from_file(file: &Path, program: &Program) -> Self {
        let mut session = Self {
            file: file.to_owned(),
            ..Self::default()
        };
        match Recording::read(file) {
            Ok(recording) => session.judge(&recording, program),
            Err(why) => {
                let path = format!("{}: ", file.display());
                let text = why.to_string();
                session
                    .refused
                    .push(text.strip_prefix(&path).unwrap_or(&text).to_owned());
            }
        }
        session
    }

    fn judge(&mut self, recording: &Recording, program: &Program) {
        self.commands = recording.events.iter().filter_map(Event::knob).collect();
        self.commands.retain(|command| command.at > Time::ZERO);
        let mut planned = recording.origin.config.knobs.iter();
        self.scripted = planned.any(|command| command.at > Time::ZERO) || is_too_fast(recording);
        self.refused.extend(recording.defect());
        if is_shipped(recording) {
            let why = "comes with ratelab: expected a session of one's own";
            self.refused.push(why.to_owned());
        }
        match judge_recording(recording) {
            Ok(rescued) => self.rescued = Some(rescued.to_string()),
            Err(failure) => self.refused.push(format!("no rescue: {failure}")),
        }
        let again = verify(recording, &program.system, VerifyWith::default(), |_| {
            ControlFlow::Continue(())
        });
        match again {
            Ok(identical) => self.verified = Some(identical.to_string()),
            Err(why) => self.refused.push(format!("not verified: {why}")),
        }
    }

    /// Returns its name in the folder of the `learner`.
    pub fn name(&self, learner: &str) -> String {
        format!("{learner}/{}", self.file_name())
    }

    /// Returns the name of the file.
    pub fn file_name(&self) -> String {
        file_name(&self.file)
    }
}

/// Returns whether a knob was turned while virtual time passed as fast as it can: a run is over
/// before a hand reaches the keys.
fn is_too_fast(recording: &Recording) -> bool {
    let origin = &recording.origin.config;
    let (mut clock, mut speed) = (origin.clock, origin.speed);
    recording.events.iter().any(|event| match event.applied() {
        Some(Command::HandOver(to)) => {
            clock = *to;
            false
        }
        Some(Command::Speed(to)) => {
            speed = *to;
            false
        }
        Some(Command::Set(_)) if event.at > Time::ZERO => {
            clock == ClockKind::Virtual && speed == Speed::Unlimited
        }
        _ => false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_knob_that_is_turned_at_full_speed_was_turned_by_no_hand() {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../recordings/rescued.rrd");
        let mut rescued = Recording::read(Path::new(file)).expect("a recording");
        rescued.origin.config.speed = Speed::REAL_TIME;
        assert!(!is_too_fast(&rescued), "at the speed of the wall");
        rescued.origin.config.speed = Speed::Unlimited;
        assert!(is_too_fast(&rescued));
        rescued.events.retain(|event| event.knob().is_none());
        assert!(!is_too_fast(&rescued), "without a knob");
    }
}
