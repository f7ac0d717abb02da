//! Policies in files: from the numbers of an observation to the numbers of an answer.
//!
//! ```text
//! PolicyFile ──► LoadedFile ──► RowPolicy
//!    path          content        ready to be asked
//! ```
//!
//! A file holds the weights of a network, an ONNX graph or a program. Whose observation it is, and what
//! an answer means, is up to the robot.
//!
//! Stands on `ratelab`, `ratelab-metrics` and `ratelab-system`; begin with [`PolicyFile`], for slow ones
//! with [`chunk`].

#![warn(clippy::print_stderr, clippy::print_stdout)]

mod cache;
mod choice;
pub mod chunk;
mod error;
mod file;
mod format;
mod loaded;
mod network;
mod onnx;
mod program;
mod program_error;
mod row_policy;

pub use cache::PolicyFiles;
pub use error::{PolicyError, PolicyFault, WeightsError};
pub use file::PolicyFile;
pub use format::{ProgramKind, way_out};
pub use loaded::LoadedFile;
pub use network::{Activation, Mlp, read_weights};
pub use onnx::RUNS_ONNX;
pub use program::end_programs;
pub use program_error::ProgramError;
pub use row_policy::{AnswerKind, Moment, PolicyContext, RowPolicy, RowShape};

/// The largest file accepted as a policy (bytes): 16 MiB, many times the size of a
/// network that can decide a thousand times a second.
pub const LARGEST_FILE: u64 = 16 << 20;
