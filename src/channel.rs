//! What lies between the publishers of a topic and its readers.

use super::{knob::Knob, time::Time};

/// Decides when a message is delivered. It never sees the payload.
pub trait Channel: Send {
    /// Message number `seq` is published at run time `now`: when is it delivered? `None`: never.
    /// A message that is delivered after a later one is overtaken, and nobody reads it.
    fn deliver_at(&mut self, seq: u64, now: Time) -> Option<Time>;

    /// Whether it delivers every message to come at once.
    fn is_perfect(&self) -> bool;

    /// Turns a knob of the topic; returns the value before.
    ///
    /// # Errors
    /// The reason, for a knob or a value that it does not know.
    fn turn(&mut self, knob: &Knob) -> Result<String, String>;
}
