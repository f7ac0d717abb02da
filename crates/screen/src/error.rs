//! Why the screen ends before a person leaves it.

use ratelab::Fault;
use ratelab_recording::RecordError;
use ratelab_system::BuildError;
use thiserror::Error;

/// Why the screen ends other than by a key.
#[derive(Debug, Error)]
pub enum ScreenError {
    /// A node failed.
    #[error(transparent)]
    Fault(#[from] Fault),
    /// A run could not be started.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// A clock's own thread panicked.
    #[error("the clock panicked, which is a defect of ratelab: please report it")]
    Panicked,
    /// A run was left because it did not end.
    #[error("the run did not end in order: {0} is still in a tick")]
    Stuck(String),
    /// A recording cannot begin.
    #[error("cannot record: {}: {}", .0.why, .0.path.display())]
    Record(RecordError),
    /// The rows of a CSV file cannot be written.
    #[error("--csv: {0}")]
    Csv(std::io::Error),
    /// The terminal cannot be read or written.
    #[error("the terminal failed: {0}")]
    Terminal(#[from] std::io::Error),
}
