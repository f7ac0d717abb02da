//! Recordings: runs in rerun's `.rrd` files.
//!
//! Stands on the core (`ratelab`), its accounts (`ratelab-account`), reruns (`ratelab-replay`) and
//! systems (`ratelab-study`); it knows no robot, terminal or command. Begin with `recorder/` to
//! see a run written, with `reader.rs` to see it read, and with `verify/` to see it compared.
//!
//! ```text
//! tap, event log ──► rows of the run ──► writer ──► columns, scene ──► file    recorder
//! file ──► frames ──► columns ──► content ──► check ──► Recording ──► replay, verify
//! ```
//!
//! Another format is a [`RecordingFormat`] with a [`RunWriter`]: the head of `recorder/mod.rs` has
//! one of text, and `writer.rs` is that of rerun.
//!
//! What is recorded of a message and of a tick is described once, in `series`: both are written,
//! read, digested and compared by the same table of columns.
//!
//! A recording holds a run twice: for readers, to the bit, and for the eye.
//!
//! | entity | what is in it | for |
//! |---|---|---|
//! | `__properties/origin` | system, configuration, graph, versions: [`schema::Origin`] as JSON | readers |
//! | `/topics/NAME` | a row per message: its numbers, `seq`, `origin_ns`, `dropped`; where they differ `stamp_ns`, `arrives_ns` | both |
//! | `/nodes/NAME` | a row per tick: lateness (µs), `tick`, `took_ns`, `overruns`; where it acted on the world `pushed_ns`, `sensed_ns` | both |
//! | `/events` | commands and ends: text, and as JSON | both |
//! | `/threads` | what the threads of the real clock did, and in which order | readers |
//! | `/checkpoint` | up to where everything is there, until the file is complete | readers |
//! | `/end` | how it ended, and how much is in it: [`schema::RecordingEnd`] as JSON | readers |
//! | `/picture`, `/plot`, `/graph` | what the viewer draws: [`scene`] | the eye |
//! | `/mode` | lanes of clock, rates and faults | the eye |
//! | `/timeline` | lanes of ticks, messages and plans, added at the end: [`scene::lanes`] | the eye |
//!
//! Everything is placed on `run_time` (ns since the run began), `control_step`
//! (messages on the system's topic of states), and under the real clock
//! `wall_time`. A file without `/end` was torn.

pub mod bins;
pub mod blueprint;

mod check;
mod columns;
mod compact;
mod content;
mod digest;
mod durations;
mod file;
mod frames;
mod limits;
mod lineage;
mod other_runtime;
pub mod printable;
mod properties;
mod reader;
mod recorded;
mod recorder;
mod replay;
mod rrd_format;
mod run_rows;
pub mod scene;
pub mod schema;
mod series;
#[cfg(test)]
mod tests;
mod thread_log;
mod tick_schedule;
mod timeline;
mod verify;
mod viewer;
mod writer;

pub use durations::{durations, with_durations};
pub use file::RecordingFile;
pub use lineage::end_of;
pub use other_runtime::OtherRun;
pub use reader::ReadError;
pub use recorded::Recording;
pub use recorder::{
    BeginRun, Destination, FinishedRecording, RecordError, Recorder, RecordingFormat, RunWriter,
    Source, StopReason, Tapped, outside,
};
pub use replay::Replay;
pub use rrd_format::RrdFormat;
pub use run_rows::RunRows;
pub use schema::{ProcessRecord, RecordingEnd};
pub use verify::{
    Branch, Change, Departure, Executed, Execution, Held, VerifyError, VerifyStatus, VerifyWith,
    branch, verify,
};
pub use viewer::{VIEWER, Viewer};
