//! The recording of a rescue: whether it is one, verified bit for bit, and the learner's
//! own.

use std::{
    ops::ControlFlow,
    path::{Path, PathBuf},
    sync::atomic::{AtomicBool, Ordering},
};

use ratelab::runtime::{Time, TimedKnob, telemetry::Event};

use super::{Graded, file_name};
use crate::{
    error::Error,
    program::Program,
    recording::{Recording, VerifyError, VerifyStatus, verify},
    rescue::{is_shipped, judge_recording},
};

/// A recording that was handed in.
pub struct GradedRun {
    /// The file.
    pub file: PathBuf,
    /// The rescue, as text, if it is one.
    pub rescued: Option<String>,
    /// What was compared bit for bit, as text, if the run was repeated without a difference.
    pub verified: Option<String>,
    /// Why it is not acceptable; empty if it is.
    pub refused: Vec<String>,
    /// The commands of the learner, in order.
    commands: Vec<TimedKnob>,
}

impl GradedRun {
    /// Judges and verifies the recording in `file`.
    ///
    /// # Errors
    /// [`Error`] after Ctrl-C, which sets `asked`.
    pub fn of(file: &Path, program: &Program, asked: &AtomicBool) -> Result<Self, Error> {
        let mut session = Self {
            file: file.to_owned(),
            rescued: None,
            verified: None,
            refused: Vec::new(),
            commands: Vec::new(),
        };
        let recording = match Recording::read(file) {
            Ok(recording) => recording,
            Err(why) => {
                let path = format!("{}: ", file.display());
                let why = why.to_string();
                let why = why.strip_prefix(&path).unwrap_or(&why);
                session.refused.push(why.to_owned());
                return Ok(session);
            }
        };
        session.commands = recording.events.iter().filter_map(Event::knob).collect();
        session.commands.retain(|command| command.at > Time::ZERO);
        session.refused.extend(recording.defect());
        if is_shipped(&recording) {
            let why = "comes with ratelab: expected a session of one's own";
            session.refused.push(why.to_owned());
        }
        match judge_recording(&recording) {
            Ok(rescued) => session.rescued = Some(rescued.to_string()),
            Err(failure) => session.refused.push(format!("no rescue: {failure}")),
        }
        let watch = |_: &VerifyStatus| match asked.load(Ordering::Relaxed) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        };
        match verify(&recording, &program.system, false, watch) {
            Ok(identical) => session.verified = Some(identical.to_string()),
            Err(why @ VerifyError::Stopped) => {
                let file = file.display().to_string();
                return Err(Error::Unverified { file, why });
            }
            Err(why) => session.refused.push(format!("not verified: {why}")),
        }
        Ok(session)
    }

    /// Its name in the folder of the `learner`.
    pub fn name(&self, learner: &str) -> String {
        format!("{learner}/{}", file_name(&self.file))
    }
}

/// Refuses sessions with the commands of another learner's session.
///
/// On the virtual clock the commands and their run times, in nanoseconds, are the whole of
/// what a person adds to a run. Hands never repeat them, whatever happens to the file.
pub fn find_copies(graded: &mut [Graded]) {
    let all: Vec<(usize, String, Vec<TimedKnob>)> = sessions(graded)
        .map(|(place, learner, session)| (place, session.name(learner), session.commands.clone()))
        .collect();
    for (place, graded) in graded.iter_mut().enumerate() {
        for session in &mut graded.sessions {
            let others = all.iter().filter(|(of, ..)| *of != place);
            let others = others.filter(|(_, _, commands)| same(&session.commands, commands));
            let names: Vec<&str> = others.map(|(_, name, _)| name.as_str()).collect();
            if !names.is_empty() {
                let why = format!("the same session as {}", names.join(", "));
                session.refused.push(why);
            }
        }
    }
}

/// All sessions, with the place and the name of the learner.
fn sessions(graded: &[Graded]) -> impl Iterator<Item = (usize, &str, &GradedRun)> {
    let learners = graded.iter().enumerate();
    learners.flat_map(|(place, graded)| {
        let sessions = graded.sessions.iter();
        sessions.map(move |session| (place, graded.learner.as_str(), session))
    })
}

/// Whether one list of commands begins with the other: a copy may be cut short. Runs
/// without commands are the same for everyone.
fn same(one: &[TimedKnob], other: &[TimedKnob]) -> bool {
    let shared = one.len().min(other.len());
    shared > 0 && one[..shared] == other[..shared]
}
