//! Fuzzers: random input to everything that takes external input, with checks that hold
//! for any input. See `README.md` in this folder.
#![cfg(unix)] // Limits, signals and terminals as Unix has them.

mod alterations;
mod cases;
mod cells;
mod command_lines;
mod graph_files;
mod keys;
mod knobs;
mod lies;
mod program;
mod recordings;
mod syntax;
mod under_load;
mod values;
mod weights;

#[path = "../support/checkpoint.rs"]
mod checkpoint;
#[path = "../support/cells.rs"]
mod columns;
#[path = "../support/load.rs"]
mod load;
#[path = "../support/memory.rs"]
mod memory;
#[path = "../../lab/tests/support/mod.rs"]
mod support;

use std::path::Path;

/// The folder of the clone.
fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}
