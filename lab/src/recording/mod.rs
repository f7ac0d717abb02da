//! Recordings: runs in rerun's `.rrd` files.
#![allow(dead_code)]

mod blueprint;
mod columns;
mod compact;
mod content;
mod destination;
mod file;
mod frames;
mod progress;
mod properties;
mod reader;
mod recorder;
mod retold;
mod scene;
pub mod schema;
#[cfg(test)]
mod tests;
mod timeline;
mod tracks;
mod verify;
mod writer;

pub use destination::Destination;
pub use reader::{ReadError, Recording};
pub use recorder::{Ending, RecordError, Recorded, Recorder, Source};
pub use retold::Retold;
pub use schema::{Origin, Outcome};
pub use verify::{VerifyError, verify};
