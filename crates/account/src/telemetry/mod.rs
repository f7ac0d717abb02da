//! Figures and copies of a running graph, without slowing it.
//!
//! A graph sends records; the sink of this room adds them to figures, which are atomics with one
//! writer, and copies messages and ticks for taps. An [`Observer`] reads the figures from any
//! thread at any time and returns a [`Snapshot`], a plain value without locks. A
//! [`ReplayCounters`] updates the same figures from a recording.

mod counters;
mod listeners;
mod meter;
mod observer;
mod push_age;
mod replay_counters;
mod run_counters;
mod snapshot;
mod tap;
mod tap_handle;
mod telemetry_sink;
mod window;

pub use counters::Flight;
pub use meter::{Distribution, Meter};
pub use observer::Observer;
pub use push_age::{PushAge, PushAgeView};
pub use replay_counters::ReplayCounters;
pub use snapshot::{MeterView, NodeView, Snapshot, SubscriptionView, TopicView};
pub use tap::{Copies, Tap, TapMessage, TickRecord};
pub use tap_handle::TapHandle;
