//! What the records of a run add up to.
//!
//! An [`Observer`] counts and measures a running graph, a [`TapHandle`] copies its messages and
//! ticks, as [`Rows`] if need be, and [`Lineage`] finds the readings behind every action, and the
//! parts of its age: live from taps, from a recording or from the network.
//!
//! Stands on the core (`ratelab`) only; a run knows nothing of it, and one that nobody looks at
//! pays nothing for it. Begin with [`Observer::of`], then `telemetry/run_counters.rs`.

mod fields;
mod lineage;
mod rows;
mod telemetry;

pub use fields::Fields;
pub use lineage::{
    AgePart, AgeParts, AgeStage, Chain, Lineage, Occupied, PushInForce, Sent, TracedTick, Unmatched,
};
pub use rows::{NamedTopic, RecordedTopic, RowInlet, RowReader, RowTap, RowWatcher, Rows};
pub use telemetry::{
    Copies, Distribution, Flight, Meter, MeterView, NodeView, Observer, PushAge, PushAgeView,
    ReplayCounters, Snapshot, SubscriptionView, Tap, TapHandle, TapMessage, TickRecord, TopicView,
};
