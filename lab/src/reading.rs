//! Reads a recording for a command.

use std::{ops::ControlFlow, path::Path};

use crate::{output::ProgressLine, printable::shown};
use ratelab_recording::{ReadError, Recording};

/// Size of a file from which on it takes seconds (bytes).
const LARGE: u64 = 16 << 20;

/// Reads a recording; a large one with a bar on standard error.
///
/// # Errors
/// As of [`Recording::read`].
pub fn read(file: &Path) -> Result<Recording, ReadError> {
    let mut bar = None;
    Recording::read_watched(file, |done, all| {
        if all >= LARGE {
            let new = || ProgressLine::new(all, shown(file));
            bar.get_or_insert_with(new).set(done);
        }
        ControlFlow::Continue(())
    })
}
