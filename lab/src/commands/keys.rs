//! `ratelab keys`: the keys of the lab.

use crate::{
    dashboard::keys::{self, LabAction},
    error::Error,
    output::print_line,
    program::Program,
};

/// Prints the keys of the lab: those that do something with the system.
pub fn print_keys(program: &Program) -> Result<(), Error> {
    let done = |action: &LabAction| match action {
        LabAction::Exercises => program.course,
        LabAction::Break => program.system.broken().is_some(),
        _ => true,
    };
    print_line(&format!(
        "{}\nwhile the cliff map is open:\n{}\nwhile a recording plays:\n{}",
        keys::LAB.text(done),
        keys::MAP.text(|_| true),
        keys::REPLAY.text(|_| true).trim_end()
    ))
}
