//! A policy in a program of its own, in any language.
//!
//! The two talk in lines of JSON (`protocol.rs`), one question and one answer at a time, over the
//! program's standard input and output (`process.rs`). A recorded run needs no program: what it
//! answered is in the recording (`recorded.rs`).

mod error;
mod process;
mod protocol;
mod recorded;

use std::{fs, os::unix::fs::PermissionsExt, sync::Arc};

pub(super) use self::recorded::RecordedPolicy;
pub use self::{error::ProgramError, process::end_programs};
use self::{
    process::PolicyProcess,
    protocol::{Greeting, ProgramQuestion, Ready},
};
use super::{Moment, Policy, PolicyContext, PolicyFault, PolicyFile, format::FileFormat};
use crate::{Action, Observation};

/// Returns whether the file at `path` with this `content` is a program: one by its first bytes, or
/// by its mode if nothing else is known of it.
///
/// # Errors
/// What a program lacks.
pub(super) fn is_program(
    path: &str,
    content: &[u8],
    format: FileFormat,
) -> Result<bool, ProgramError> {
    let not_executable = |kind| ProgramError::NotExecutable {
        kind,
        path: path.to_owned(),
    };
    match format {
        FileFormat::Script | FileFormat::Binary if is_executable(path) => Ok(true),
        FileFormat::Script => Err(not_executable("script")),
        FileFormat::Binary => Err(not_executable("program")),
        FileFormat::Unknown if is_executable(path) && !is_named_as_weights(path) => {
            // Other systems have binaries of other formats.
            if content.contains(&0) {
                return Ok(true);
            }
            Err(ProgramError::NoInterpreter)
        }
        _ => Ok(false),
    }
}

fn is_named_as_weights(path: &str) -> bool {
    let ends = [".pt", ".pth", ".safetensors", ".onnx"];
    ends.iter().any(|end| path.ends_with(end))
}

fn is_executable(path: &str) -> bool {
    fs::metadata(path).is_ok_and(|file| file.permissions().mode() & 0o111 != 0)
}

/// Asks a program, which runs from [`start`](Policy::start) until this is dropped.
pub(super) struct ProgramPolicy {
    name: String,
    file: PolicyFile,
    context: PolicyContext,
    running: Option<(PolicyProcess, Ready)>,
    moment: Moment,
    asked: u64,
    crash: Option<String>,
}

impl ProgramPolicy {
    pub(super) fn new(name: &str, file: PolicyFile, context: PolicyContext) -> Self {
        Self {
            name: name.to_owned(),
            file,
            context,
            running: None,
            moment: Moment::default(),
            asked: 0,
            crash: None,
        }
    }

    /// Asks about a reading; `None` if it crashes.
    fn ask(&mut self, reading: &Observation) -> Option<Vec<f32>> {
        let (process, ready) = self.running.as_mut()?;
        self.asked += 1;
        let question = ProgramQuestion {
            id: self.asked,
            time: self.moment.origin.as_secs_f64(),
            delay_ms: ready
                .chunks
                .then(|| 1e3 * self.moment.delay().as_secs_f64()),
            observation: reading.to_array().map(f64::from),
        };
        let answer = process
            .ask(&protocol::line(&question), ready.limit)
            .and_then(|line| {
                let actions = self.context.chunk.filter(|_| ready.chunks);
                protocol::actions(&line, self.asked, actions)
            });
        answer.map_err(|why| self.fail(&why)).ok()
    }

    /// The program is ended: what it said would be another answer than that to the question.
    fn fail(&mut self, why: &ProgramError) {
        self.running = None;
        self.crash = Some(format!(
            "{} {why}: \"restart policy\" starts it again",
            self.name
        ));
    }
}

impl Policy for ProgramPolicy {
    fn name(&self) -> &str {
        &self.name
    }

    fn start(&mut self) -> Result<(), PolicyFault> {
        self.file.read()?;
        let greeting = Greeting::new(self.context);
        let mut process = PolicyProcess::start(&self.file.path)?;
        let ready = Ready::read(&process.ask(&protocol::line(&greeting), protocol::START)?)?;
        if ready.chunks && self.context.chunk.is_none() {
            return Err(ProgramError::Chunks.into());
        }
        self.running = Some((process, ready));
        Ok(())
    }

    fn begin(&mut self, moment: Moment) {
        self.moment = moment;
    }

    fn act(&mut self, observation: &Observation) -> Action {
        let actions = self.ask(observation).unwrap_or_default();
        Action(actions.first().copied().unwrap_or_default())
    }

    fn whole_chunk(&mut self, reading: &Observation) -> Option<Arc<[f32]>> {
        let (_, ready) = self.running.as_ref()?;
        let actions = ready.chunks.then(|| self.ask(reading))?;
        Some(actions.unwrap_or_default().into())
    }

    fn crash(&mut self) -> Option<String> {
        self.crash.take()
    }
}
