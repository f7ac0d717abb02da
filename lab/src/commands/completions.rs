//! `ratelab completions`: what makes a shell complete.

use clap::CommandFactory;
use clap_complete::{Shell, generate};

use crate::{cli::Cli, error::Error, output::print_line};

/// Prints the script for `shell`.
pub fn completions(shell: Shell) -> Result<(), Error> {
    let mut command = Cli::command();
    let name = command.get_name().to_owned();
    // Generated in memory first: writing to a pipe that is closed would panic.
    let mut script = Vec::new();
    generate(shell, &mut command, name, &mut script);
    print_line(String::from_utf8_lossy(&script).trim_end())
}
