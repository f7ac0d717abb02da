//! Ticks on messages, of one topic or of sets from several.

mod approximate;
mod matcher;
mod port;

pub(crate) use port::Trigger;

/// The sequence numbers of a set of messages, one for each input.
type MessageSet = Vec<u64>;
