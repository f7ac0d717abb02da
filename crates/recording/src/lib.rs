//! Recordings: runs in files, rerun's `.rrd` files for now.
//!
//! Stands on `ratelab`, `ratelab-metrics`, `ratelab-real-clock`, `ratelab-re-execution`,
//! `ratelab-experiment` and `ratelab-system`; knows no robot, terminal or command. Begin with `recorder/`.
//!
//! ```text
//! tap, event log ──► recorder ──► a format: rrd ──► file
//! file ──► rrd ──► check ──► Recording ──► replay, verify
//! ```
//!
//! | file or folder | what is in it |
//! |---|---|
//! | `run/` | a recorded run as a value |
//! | `recorder/` | the thread that records a run in some format; another one begins at its head |
//! | `rrd/` | rerun's format, the only part that knows rerun: writer, reader, viewer, what is drawn |
//! | `check.rs` | what a file claims, against what is in it |
//! | `replay.rs` | a recording, replayed into the counters of a screen |
//! | `durations.rs` | durations measured in a run, for draws in another |
//! | `printable.rs` | texts of others, made safe for a terminal |
//! | `verify/` | a recorded run executed again and compared |
//!
//! What is recorded of a message and of a tick is described once, in `run/series.rs`: both are
//! written, read, digested and compared by the same table of columns.

#![warn(clippy::print_stderr, clippy::print_stdout)]

mod check;
mod durations;
pub mod printable;
mod recorder;
mod replay;
pub mod rrd;
mod run;
mod verify;

pub use durations::{durations, with_durations, with_durations_in};
pub use recorder::{
    BeginRun, Destination, FinishedRecording, RecordError, Recorder, RecordingFormat, RunWriter,
    Source, StopReason, Tapped, outside,
};
pub use replay::Replay;
pub use rrd::{
    ReadError, RrdFormat, VIEWER, Viewer, ViewerError,
    scene::latency::{BINS, width_ms},
};
pub use run::{
    Origin, OtherRun, ProcessRecord, Recording, RecordingEnd, RunResult, RunRows, RunStatus,
    VerdictRecord, end_of,
};
pub use verify::{
    Branch, Change, Departure, Executed, Execution, Held, Identical, VerifyError, VerifyStatus,
    VerifyWith, branch, verify,
};
