//! What is wrong with a model.

use thiserror::Error;

/// A defect of a model.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum RobotModelError {
    /// A file that does not exist.
    #[error("no such file: {0}")]
    Missing(String),
    /// A file elsewhere.
    #[error("{0} is outside of the folder of the graph file")]
    Outside(String),
    /// Too many bytes.
    #[error("the files of the model have more than {0} MiB together")]
    Files(u64),
    /// A plugin of MuJoCo.
    #[error("the model has a plugin: leave it out")]
    Plugin,
    /// What MuJoCo says of it.
    #[error("MuJoCo: {0}")]
    Mujoco(String),
    /// A model that nothing can be done with.
    #[error("the model has no {0}")]
    Without(&'static str),
    /// More than is supported.
    #[error("the model has {found} {what}: expected up to {most}")]
    Size {
        /// What there is too much of.
        what: &'static str,
        /// How much there is.
        found: i64,
        /// How much may be.
        most: i64,
    },
    /// An invalid step of physics.
    #[error("the model's timestep is {0} s: expected whole microseconds from 0.00001 to 0.1")]
    Step(String),
    /// An unreadable model in a recording.
    #[error("the model in the recording is damaged")]
    Damaged,
}
