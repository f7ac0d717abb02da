//! Messages that belong together.

/// The sequence numbers of a set, one for each input.
pub type Choice = Vec<u64>;
