//! rerun's format: its files are written, read, and shown by its viewer.
//!
//! ```text
//! rows of the run, event log ──► writer ──► columns, scene ──► file
//! file ──► frames ──► columns ──► content ──► Recording
//! ```
//!
//! A recording holds a run twice: bit for bit for readers, and as pictures for the viewer.
//!
//! | entity | what is in it | for |
//! |---|---|---|
//! | `__properties/origin` | system, configuration, graph, versions: [`Origin`](crate::Origin) as JSON | readers |
//! | `/topics/NAME` | a row per message: its numbers, `seq`, `origin_ns`, `dropped`; where they differ `stamp_ns`, `arrives_ns` | both |
//! | `/nodes/NAME` | a row per tick: lateness (µs), `tick`, `took_ns`, `overruns`; where it acted on the world `pushed_ns`, `sensed_ns` | both |
//! | `/events` | commands and ends: text, and as JSON | both |
//! | `/threads` | what the threads of the real clock did, and in which order | readers |
//! | `/checkpoint` | up to where everything is there, until the file is complete | readers |
//! | `/end` | how it ended, and how much is in it: [`RecordingEnd`](crate::RecordingEnd) as JSON | readers |
//! | `/picture`, `/plot`, `/graph` | what the viewer draws: [`scene`] | viewer |
//! | `/mode` | lanes of clock, rates and faults | viewer |
//! | `/timeline` | lanes of ticks, messages and plans, added at the end: [`scene::lanes`] | viewer |
//!
//! Everything is placed on `run_time` (ns since the run began), `control_step`
//! (messages on the system's topic of states), and under the real clock
//! `wall_time`. A file without `/end` was torn.

pub mod blueprint;
mod columns;
mod content;
mod curves;
mod file;
mod frames;
mod reader;
pub mod scene;
pub mod schema;
mod thread_log;
pub mod timeline;
mod viewer;
mod writer;

pub use curves::{Curve, CurvePlot, CurvePlots};
pub use file::RecordingFile;
pub use reader::{ReadError, RrdFormat};
pub use viewer::{VIEWER, Viewer, ViewerError};

/// Returns the version of rerun for which files are written.
pub fn rerun_version() -> String {
    rerun::build_info().version.to_string()
}
