//! Shared helpers for tests of the command.
#![allow(dead_code)] // Each test uses its own part.

pub mod outside;

use std::{
    path::Path,
    process::{Command, Output},
};

use tempfile::TempDir;

/// `ratelab` without arguments yet.
pub fn command() -> Command {
    Command::new(env!("CARGO_BIN_EXE_ratelab"))
}

/// The output of `ratelab` with `args`.
pub fn ratelab(args: &[&str]) -> Output {
    command().args(args).output().expect("ratelab starts")
}

/// Output as text.
pub fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}

/// The single error line of `ratelab`, which must have exited with `code`.
pub fn complaint(output: &Output, code: i32) -> String {
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    said
}

/// A folder that is removed after the test.
pub fn folder() -> TempDir {
    TempDir::new().expect("a folder")
}

/// The file `name` in `folder`, as an argument.
pub fn path(folder: &TempDir, name: &str) -> String {
    folder.path().join(name).display().to_string()
}

/// The reference recording `name`, as an argument.
pub fn reference(name: &str) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    root.join("recordings").join(name).display().to_string()
}
