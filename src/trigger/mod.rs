//! Ticks on messages, of one topic or of sets from several.

mod approximate;
mod inputs;
mod matcher;

pub(crate) use inputs::Trigger;

/// The sequence numbers of a set of messages, one for each input.
type MessageSet = Vec<u64>;
