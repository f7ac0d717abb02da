//! The project compared with the theoretical floor and with alternatives, in one run:
//! `cargo bench --bench ratios`.
//!
//! The table contains *ratios*, because a time alone depends on the machine as much as on
//! the program: both sides of a ratio are measured in this process, seconds apart. They
//! alternate, round after round, so that a slower machine slows both; the *median* over
//! the rounds is shown, because other load only ever adds time, and much of it only in a
//! few rounds.
//!
//! A missed goal is a word in the table and no failure: a build must not depend on the
//! load of a machine.

mod graphs;
#[cfg(target_os = "linux")]
mod lateness;
mod messages;
mod paired;
mod policies;
mod re_execution;
mod runs;
mod table;

use table::Table;

fn main() {
    let mut table = Table::default();
    runs::measure(&mut table);
    policies::measure(&mut table);
    messages::measure(&mut table);
    graphs::measure(&mut table);
    re_execution::measure(&mut table);
    #[cfg(target_os = "linux")]
    lateness::measure(&mut table);
    println!("{table}");
}
