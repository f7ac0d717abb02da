//! Recordings and bags, read with a line of progress.

use std::{ops::ControlFlow, path::Path};

use ratelab_bag::Bag;
use ratelab_recording::{ReadError, Recording};

use crate::{error::Error, output::ProgressLine};
use ratelab_recording::printable::shown;

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

/// Size of a bag from which on it takes seconds (bytes).
const LARGE_BAG: u64 = 64 << 20;

/// Reads the bag at `path`; a large one with a bar on standard error.
///
/// # Errors
/// [`Error::BadInput`] if there is no bag.
pub fn read_bag(path: &Path) -> Result<Bag, Error> {
    let mut bar = None;
    let bag = ratelab_bag::read(path, &mut |done, all| {
        if all >= LARGE_BAG {
            let new = || ProgressLine::new(all, shown(path));
            bar.get_or_insert_with(new).set(done);
        }
        ControlFlow::Continue(())
    });
    bag.map_err(|why| Error::BadInput(why.to_string()))
}

/// Returns an error for a bag of which only the intact part was read.
///
/// # Errors
/// [`Error::Unfinished`] with the first damage.
pub fn if_damaged(bag: &Bag) -> Result<(), Error> {
    let Some(first) = bag.damage.first() else {
        return Ok(());
    };
    let others = match bag.damage.len() - 1 {
        0 => String::new(),
        others => format!(" (and {others} more: see --json)"),
    };
    Err(Error::Unfinished(format!("{first}{others}")))
}
