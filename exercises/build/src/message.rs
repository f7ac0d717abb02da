//! A published value.

/// A value with its times. All times are nanoseconds since the start of the run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Message<T> {
    /// The value.
    pub data: T,
    /// Time of its publication.
    pub stamp: u64,
    /// Its number in the topic, counted from zero.
    pub seq: u64,
    /// Time of the sensing that it was derived from, if it was derived.
    pub origin: Option<u64>,
}
