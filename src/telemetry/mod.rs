//! Observation of a running graph without slowing it.
//!
//! Counters are atomics with one writer; durations go through [`Meter`]s that never block
//! the measuring thread. An [`Observer`] reads them from any thread at any time and
//! returns a [`Snapshot`], a plain value without locks. A [`ReplayCounters`] updates the
//! same counters from a record.

mod counters;
mod event_log;
mod meter;
mod observer;
mod push_age;
mod rates;
mod replay_counters;
mod topology;
mod window;

pub(crate) use super::event::{Event, EventKind};
pub use counters::Flight;
pub use meter::{Distribution, Meter, MeterRecorder};
pub use observer::{MeterView, NodeView, Observer, Snapshot, Status, SubscriptionView, TopicView};
pub use push_age::{PushAge, PushAgeView};
pub use replay_counters::ReplayCounters;
pub use topology::{NodeTopology, TopicTopology, Topology};

pub(crate) use counters::{NodeCounters, ReadMark, TopicCounters};
pub(crate) use event_log::EventLog;
pub(crate) use observer::{NodeEntry, RunState, SubscriptionEntry, TickMeters, TopicEntry};
pub(crate) use window::RateWindow;
