//! The `ratelab` command.

mod bins;
mod cli;
mod csv;
mod dashboard;
mod error;
mod exercise;
mod lab;
mod metrics;
mod options;
mod recording;
mod replay;
mod report;
mod review;
mod run;
mod sweep;

use std::process::ExitCode;

use clap::Parser;

use cli::{Cli, Command};

fn main() -> ExitCode {
    let outcome = match Cli::try_parse() {
        Ok(cli) => match &cli.command {
            None => lab::lab(&cli.lab),
            Some(Command::Lab(args)) => lab::lab(args),
            Some(Command::Run(args)) => run::run(args),
            Some(Command::Sweep(args)) => sweep::sweep(args),
            Some(Command::Replay(args)) => replay::replay(args),
            Some(Command::Info { file }) => review::info(file),
            Some(Command::Verify { files }) => review::verify_all(files),
            Some(Command::Exercise(args)) => exercise::exercise(args),
            Some(Command::Keys) => lab::keys(),
        },
        Err(error) => cli::explain(&error),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            error.exit_code()
        }
    }
}
