//! The error of a setting of chunks.

use thiserror::Error;

/// An invalid text of a setting of chunks; each variant has the text.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ChunkError {
    /// The number of actions in a chunk.
    #[error("{text:?} is not a chunk: expected 1 to {max} actions, or none")]
    Chunk {
        /// The text.
        text: String,
        /// The longest chunk.
        max: usize,
    },
    /// One of a list of names.
    #[error("{text:?} is not a {what}: expected {expected}")]
    Name {
        /// The text.
        text: String,
        /// What the names are of.
        what: &'static str,
        /// The names.
        expected: String,
    },
    /// What happens where chunks overlap.
    #[error(
        "{text:?} is not a way to merge: expected newest, blend:W with a weight of 0 to 1, or \
         ensemble:M with a decay of 0 to {max_decay}"
    )]
    Merge {
        /// The text.
        text: String,
        /// The greatest decay.
        max_decay: String,
    },
    /// The delay that a policy plans for.
    #[error("{0:?} is not an expected delay: expected milliseconds, last, max, last+MS or max+MS")]
    ExpectedDelay(String),
    /// When the player asks for the next chunk.
    #[error("{0:?} is not a share of a chunk: expected 0 to 1, or none")]
    Refill(String),
}
