//! Ours beside the floor and the alternatives, in one run: `cargo bench --bench ratios`.
//!
//! A table of *ratios*, because a time alone says as much about the machine as
//! about the program: both sides of a ratio are measured in this process,
//! seconds apart. They take turns, round after round, so that a machine that
//! slows down slows both; and the *median* over the rounds is shown, because
//! whatever else the machine does only ever adds time, to a few rounds a lot.
//!
//! A goal that is missed is a word in the table and not a failure: no build
//! should depend on how busy a machine was.

mod graphs;
#[cfg(target_os = "linux")]
mod lateness;
mod messages;
mod paired;
mod policies;
mod runs;
mod table;

use table::Table;

fn main() {
    let mut table = Table::default();
    runs::measure(&mut table);
    policies::measure(&mut table);
    messages::measure(&mut table);
    graphs::measure(&mut table);
    #[cfg(target_os = "linux")]
    lateness::measure(&mut table);
    println!("{table}");
}
