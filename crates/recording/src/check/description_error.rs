//! The error of a recording's description of its run.

use thiserror::Error;

/// Why the description of the run in a recording is not understood.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum DescriptionError {
    /// It is not what a recorder writes.
    #[error("what this recording says of itself is damaged")]
    Damaged,
    /// A part of the file is not what a recorder writes.
    #[error("this recording is damaged")]
    DamagedFile,
    /// Its graph is not one that can be built.
    #[error("the graph in this recording is damaged")]
    DamagedGraph,
    /// Its graph is larger than any that is recorded.
    #[error(
        "the graph in this recording has {parts} parts (nodes, topics, their ends, meters): up to \
         {max} are read"
    )]
    LargeGraph {
        /// Number of parts.
        parts: usize,
        /// Number of parts that are read.
        max: usize,
    },
    /// Another version of the format.
    #[error("this recording is of format {found}, this ratelab {reads} {known}: {why}")]
    Format {
        /// The version of the file.
        found: u64,
        /// Which versions are read.
        reads: &'static str,
        /// The version that is written.
        known: u32,
        /// What to do, or why.
        why: &'static str,
    },
}
