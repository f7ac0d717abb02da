//! The errors of a program.

use std::time::Duration;

use thiserror::Error;

/// What is wrong with a program, as the end of a sentence about it.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ProgramError {
    /// The mode of its file does not let it run.
    #[error("this {kind} is not executable: chmod +x {path}")]
    NotExecutable {
        /// Script or program.
        kind: &'static str,
        /// The path of its file.
        path: String,
    },
    /// A script that names no interpreter.
    #[error(
        "this program has no first line #! that names its interpreter, such as \
         #!/usr/bin/env python3"
    )]
    NoInterpreter,
    /// The interpreter that it names does not exist.
    #[error("cannot be started: the interpreter in its first line is missing")]
    InterpreterMissing,
    /// The system does not start it.
    #[error("cannot be started: {0}")]
    NotStarted(String),
    /// The whole command ends.
    #[error("was not started: the command ends")]
    CommandEnds,
    /// A chunk for a run with single actions.
    #[error("it answers with chunks: give --chunk H")]
    Chunks,
    /// A line that nobody asked for.
    #[error("answered without a question")]
    NoQuestion,
    /// A line without an end.
    #[error("answered with a line of more than 64 KiB")]
    LongLine,
    /// Bytes that are not UTF-8.
    #[error("answered with bytes that are not text")]
    NotText,
    /// No line in time.
    #[error("gave no answer for {} s, and was ended", .0.as_secs_f64())]
    Timeout(Duration),
    /// The program has ended.
    #[error("{0}")]
    Ended(String),
    /// A time limit that it may not ask for.
    #[error("asked for a limit_s of {limit}: expected seconds up to {max}")]
    Limit {
        /// What it asked for (s).
        limit: String,
        /// The longest limit (s).
        max: u64,
    },
    /// The answer to another question.
    #[error("answered question {found} where {asked} was asked")]
    Question {
        /// Number of the question that it answered.
        found: u64,
        /// Number of the question that was asked.
        asked: u64,
    },
    /// A chunk of another length.
    #[error("answered with {found} actions, and a chunk has {expected}")]
    ChunkLength {
        /// Number of actions in the answer.
        found: usize,
        /// Number of actions in a chunk.
        expected: usize,
    },
    /// Another number of numbers in an action.
    #[error("answered with an action of {found} numbers, and the robot has {expected} controls")]
    ActionLength {
        /// Numbers in the answer.
        found: usize,
        /// Numbers in an action.
        expected: usize,
    },
    /// An action that is not a finite number.
    #[error("answered {0}: an action must be a finite float32")]
    NotFinite(String),
    /// A line of another format.
    #[error("answered {shown}: expected {expected}")]
    Unexpected {
        /// The line, or its beginning, in quotation marks.
        shown: String,
        /// An example of the expected format.
        expected: String,
    },
}
