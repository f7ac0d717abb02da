//! The error of a setting's text.

use std::fmt;

use ratelab_policy::chunk::ChunkError;
use thiserror::Error;

/// An invalid text of a setting; each variant has the text.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ParameterError {
    /// A setting of chunks.
    #[error(transparent)]
    Chunk(#[from] ChunkError),
    /// The model of a plan.
    #[error(
        "{text:?} is not a model: expected length:F, the pole's length as a multiple of the plant's, \
         {min} to {max}"
    )]
    Model {
        /// The text.
        text: String,
        /// The smallest factor.
        min: String,
        /// The greatest factor.
        max: String,
    },
    /// What happens with a stale action.
    #[error("{0:?} is not a setting for stale actions: expected hold or zero:MS, such as zero:50")]
    OnStale(String),
    /// A random force on the cart.
    #[error("{text:?} is not a disturbance: expected a force in newtons, 0 to {max}")]
    Disturbance {
        /// The text.
        text: String,
        /// The greatest force (N).
        max: String,
    },
    /// What a policy in a file sees.
    #[error(
        "{0:?} is not an observation: expected names of x, v, cos, sin, theta, spin and numbers, such \
         as \"x v theta spin\", also with a factor: theta*2"
    )]
    Observe(String),
    /// The distance of similar readings.
    #[error("{0:?} is not a distance of readings: expected 0 or more, such as 0.1")]
    Distance(String),
}

/// Returns the text of `error`, for traits whose errors are texts.
pub(crate) fn in_words(error: impl fmt::Display) -> String {
    error.to_string()
}
