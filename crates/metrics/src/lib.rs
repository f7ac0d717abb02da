//! What the records of a run add up to.
//!
//! A graph sends records. They are added to the accounts of its nodes and topics, which an
//! [`Observer`] reads from any thread at any time as a [`Snapshot`], a plain value; a [`TapHandle`]
//! copies messages and ticks, as [`Rows`] if need be. [`ReplayAccounts`] adds up the same accounts from
//! what a recording or the network holds, and [`Lineage`] finds the readings behind every action,
//! and the parts of its age, from either.
//!
//! Stands on `ratelab`; a run knows nothing of it, and one that nobody looks at
//! pays nothing for it. Begin with `accounts.rs`.

#![warn(clippy::print_stderr, clippy::print_stdout)]

mod accounts;
mod distribution;
mod fields;
mod lineage;
mod node;
mod replay_accounts;
mod sawtooth;
mod tap;
mod tap_handle;
mod topic;

pub use accounts::{Observer, Snapshot};
pub use distribution::Distribution;
pub use fields::{Fields, Rows};
pub use lineage::{
    AgeOverTime, AgePart, AgeParts, AgeStage, Chain, Lineage, PushInForce, TickPlace, TickWait,
    TracedTick, WaitsFor, mean_parts, nanos,
};
pub use node::{NodeAccount, TickCauses, TickRecord, TopicRead};
pub use replay_accounts::ReplayAccounts;
pub use sawtooth::{LATELY, LateAge, PushAge, Sawtooth};
pub use tap::{Copies, Tap, TapMessage};
pub use tap_handle::{
    NamedTopic, RecordedTopic, RowInlet, RowListener, RowReader, RowTap, RunRow, TapHandle,
};
pub use topic::{Flight, ReaderAccount, TopicAccount};
