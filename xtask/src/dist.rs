//! Starts the crate `dist`, which has external dependencies: set-up needs none.

use std::{
    env,
    ffi::OsString,
    process::{Command, ExitCode},
};

/// Compiles and runs it, optimised, because it compresses tens of megabytes.
pub fn run(options: &[OsString]) -> ExitCode {
    let cargo = env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut dist = Command::new(cargo);
    dist.args(["run", "--quiet", "--release", "--package", "dist", "--"]);
    match dist.args(options).status() {
        Ok(status) => status.code().map_or(ExitCode::FAILURE, exit_code),
        Err(error) => {
            eprintln!("error: cargo cannot be run: {error}");
            ExitCode::FAILURE
        }
    }
}

fn exit_code(code: i32) -> ExitCode {
    ExitCode::from(u8::try_from(code).unwrap_or(1))
}
