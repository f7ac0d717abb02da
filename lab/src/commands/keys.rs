//! `ratelab keys`: the keys of the lab.

use crate::{dashboard::keys, error::Error, output::print_line};

/// Prints the keys of the lab.
pub fn print_keys() -> Result<(), Error> {
    let replay = keys::REPLAY.text();
    print_line(&format!(
        "{}\nwhile the cliff map is open:\n{}\nwhile a recording plays:\n{}",
        keys::LAB.text(),
        keys::MAP.text(),
        replay.trim_end()
    ))
}
