//! What an observer may know about a running graph without slowing it.
//!
//! Counters are atomics with one writer, durations go through
//! [`Meter`]s that never make the measuring thread wait. An [`Observer`] reads
//! them from any thread at any time and returns a [`Snapshot`], a plain value
//! that holds no lock. A [`Retelling`] moves the same counters from a record.

mod journal;
mod meter;
mod observer;
mod retelling;
mod shape;
mod window;

pub use journal::{Event, Happening};
pub use meter::{Distribution, Meter, Recorder};
pub use observer::{MeterView, NodeView, Observer, Snapshot, Status, SubscriptionView, TopicView};
pub use retelling::Retelling;
pub use shape::{NodeShape, Shape, TopicShape};

pub(crate) use journal::Journal;
pub(crate) use observer::{NodeEntry, Shared, SubscriptionEntry, TopicEntry};
pub(crate) use window::RateWindow;
