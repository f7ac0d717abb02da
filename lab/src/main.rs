//! The `ratelab` command.

// Errors go through `output`, which makes them fit for a terminal.
#![warn(clippy::print_stderr)]

mod bins;
mod cli;
mod commands;
mod csv;
mod dashboard;
mod error;
mod metrics;
mod options;
mod output;
mod predictions;
mod printable;
mod recording;
mod report;
mod rescue;
mod results;
mod screen;
mod signals;
mod sweep;
mod version;

use std::process::ExitCode;

use clap::Parser;

use cli::{Cli, Command};

fn main() -> ExitCode {
    signals::outlive_size_limit();
    let outcome = match Cli::try_parse() {
        Ok(cli) => match &cli.command {
            None => commands::lab(&cli.lab),
            Some(Command::Lab(args)) => commands::lab(args),
            Some(Command::Run(args)) => commands::run(args),
            Some(Command::Sweep(args)) => commands::sweep(args),
            Some(Command::Replay(args)) => commands::replay(args),
            Some(Command::Info(args)) => commands::info(&args.file),
            Some(Command::Verify(args)) => commands::verify(&args.files),
            Some(Command::Exercise(args)) => commands::exercise(args),
            Some(Command::Keys) => commands::print_keys(),
            Some(Command::Completions { shell }) => commands::completions(*shell),
            Some(Command::Man { folder }) => commands::man(folder.as_deref()),
        },
        Err(error) => cli::explain(&error),
    };
    if let Err(error) = &outcome {
        output::error(error);
    }
    let signal = signals::exit_code().map(ExitCode::from);
    signal.unwrap_or_else(|| outcome.map_or_else(|error| error.exit_code(), |()| ExitCode::SUCCESS))
}
