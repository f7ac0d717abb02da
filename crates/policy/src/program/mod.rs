//! A policy in a program of its own, in any language.
//!
//! The two talk in lines of JSON (`protocol.rs`), one question and one answer at a time, over the
//! program's standard input and output (`process.rs`). A recorded run needs no program: what it
//! answered is in the recording (`recorded.rs`).

mod process;
mod protocol;
mod recorded;

use std::{fs, os::unix::fs::PermissionsExt};

pub use self::process::end_programs;
pub(crate) use self::recorded::RecordedPolicy;
use self::{
    process::PolicyProcess,
    protocol::{AnswerSize, Greeting, ProgramQuestion, Ready},
};
use crate::{
    AnswerKind, Moment, PolicyContext, PolicyFault, PolicyFile, ProgramError, RowPolicy, RowShape,
    format::FileFormat,
};

/// Returns whether the file at `path` with this `content` is a program: one by its first bytes, or
/// by its mode if nothing else is known of it.
///
/// # Errors
/// What a program lacks.
pub(crate) fn is_program(
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

/// Asks a program, which runs from [`start`](RowPolicy::start) until this is dropped.
pub(crate) struct ProgramPolicy {
    name: String,
    file: PolicyFile,
    context: PolicyContext,
    shape: RowShape,
    running: Option<(PolicyProcess, Ready)>,
    moment: Moment,
    asked: u64,
    answer: Vec<f64>,
    crash: Option<String>,
}

impl ProgramPolicy {
    pub(crate) fn new(file: PolicyFile, context: PolicyContext, shape: RowShape) -> Self {
        Self {
            name: file.name().to_owned(),
            file,
            context,
            shape,
            running: None,
            moment: Moment::default(),
            asked: 0,
            answer: Vec::new(),
            crash: None,
        }
    }

    /// Asks about a reading; `None` if it crashes.
    fn ask(&mut self, observation: &[f64]) -> Option<Vec<f64>> {
        let (process, ready) = self.running.as_mut()?;
        self.asked += 1;
        let question = ProgramQuestion {
            id: self.asked,
            time: self.moment.origin.as_secs_f64(),
            delay_ms: ready
                .chunks
                .then(|| 1e3 * self.moment.delay().as_secs_f64()),
            observation,
        };
        let answer = process
            .ask(&protocol::line(&question), ready.limit)
            .and_then(|line| {
                let size = match self.context.chunk.filter(|_| ready.chunks) {
                    Some(actions) => AnswerSize::Chunk {
                        actions,
                        width: self.shape.acts,
                    },
                    None => AnswerSize::from_shape(self.shape),
                };
                protocol::actions(&line, self.asked, size)
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

impl RowPolicy for ProgramPolicy {
    fn start(&mut self) -> Result<(), PolicyFault> {
        self.file.read()?;
        let greeting = Greeting::new(self.context, self.shape);
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

    fn answer(&mut self, observation: &[f64]) -> &[f64] {
        self.answer = self.ask(observation).unwrap_or_default();
        &self.answer
    }

    fn kind(&self) -> AnswerKind {
        match &self.running {
            Some((_, ready)) if ready.chunks => AnswerKind::WholeChunk,
            _ => AnswerKind::Action,
        }
    }

    fn crash(&mut self) -> Option<String> {
        self.crash.take()
    }
}
