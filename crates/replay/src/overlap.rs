//! Ticks that overlap, operation by operation.

use std::sync::Arc;

use ratelab::Time;

/// Ticks and commands that overlap, so that none of them can be executed whole before the
/// others.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Overlap {
    /// Run time at which the first of them began.
    pub from: Time,
    /// Run time at which the last of them began.
    pub to: Time,
    /// Their operations in order.
    pub operations: Vec<OverlapOperation>,
}

/// An access to what nodes share, within an [`Overlap`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OverlapOperation {
    /// Index of the node in the graph; `None` for the thread that supervises them.
    pub node: Option<usize>,
    /// Run time at which its tick began.
    pub at: Time,
    /// Name of the topic, or of the [`Shared`](ratelab::Shared) value.
    pub takes: Arc<str>,
    /// Its turn there, counted from zero.
    pub turn: u64,
}
