//! What tests of the command share.
#![allow(dead_code)] // Each test uses its own part.

use std::process::{Command, Output};

use tempfile::TempDir;

/// What `ratelab` answers to `args`.
pub fn ratelab(args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_ratelab"));
    command.args(args).output().expect("ratelab starts")
}

/// Output as text.
pub fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}

/// The file `name` in `folder`, as an argument.
pub fn path(folder: &TempDir, name: &str) -> String {
    folder.path().join(name).display().to_string()
}
