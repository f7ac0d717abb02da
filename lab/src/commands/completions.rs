//! `ratelab completions`: completion scripts for shells.

use clap_complete::{Shell, generate};

use crate::{cli, error::Error, output::print_data, program::Program};

/// Prints the script for `shell`.
pub fn completions(program: &Program, shell: Shell) -> Result<(), Error> {
    let mut command = cli::command(program);
    let name = command.get_name().to_owned();
    // Generated in memory first, because the generator panics when it writes to a closed
    // pipe.
    let mut script = Vec::new();
    generate(shell, &mut command, name, &mut script);
    print_data(String::from_utf8_lossy(&script).trim_end())
}
