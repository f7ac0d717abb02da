//! The `ratelab` command.

// Errors go through `output`, which makes them fit for a terminal.
#![warn(clippy::print_stderr)]

mod bins;
mod cli;
mod completions;
mod csv;
mod dashboard;
mod error;
mod exercise;
mod lab;
mod man;
mod metrics;
mod options;
mod output;
mod printable;
mod recording;
mod replay;
mod report;
mod review;
mod run;
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
            None => lab::lab(&cli.lab),
            Some(Command::Lab(args)) => lab::lab(args),
            Some(Command::Run(args)) => run::run(args),
            Some(Command::Sweep(args)) => sweep::sweep(args),
            Some(Command::Replay(args)) => replay::replay(args),
            Some(Command::Info(args)) => review::info(&args.file),
            Some(Command::Verify(args)) => review::verify_all(&args.files),
            Some(Command::Exercise(args)) => exercise::exercise(args),
            Some(Command::Keys) => lab::keys(),
            Some(Command::Completions { shell }) => completions::completions(*shell),
            Some(Command::Man { folder }) => man::man(folder.as_deref()),
        },
        Err(error) => cli::explain(&error),
    };
    if let Err(error) = &outcome {
        output::error(error);
    }
    let signal = signals::exit_code().map(ExitCode::from);
    signal.unwrap_or_else(|| outcome.map_or_else(|error| error.exit_code(), |()| ExitCode::SUCCESS))
}
