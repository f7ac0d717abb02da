//! The user's Python, which includes pip and unpacks wheels.

use std::env;
use std::ffi::{OsStr, OsString};
use std::path::Path;
use std::process::{Command, Stdio};

use super::error::{Error, remedy};

/// A working Python.
pub(super) struct Python<'a> {
    program: OsString,
    scratch: &'a Path,
}

impl<'a> Python<'a> {
    /// Takes `$PYTHON` if that is set, else `python3`, else `python`. Its temporary files
    /// go to `scratch`.
    pub(super) fn find(scratch: &'a Path) -> Result<Self, Error> {
        let candidates = candidates();
        let tried = candidates.join(OsStr::new(", "));
        candidates
            .into_iter()
            .map(|program| Self { program, scratch })
            .find(|python| python.run(["--version"]).is_ok())
            .ok_or_else(|| {
                let tried = tried.to_string_lossy();
                let cause = format!("no Python starts (tried: {tried}).");
                Error::new(cause, remedy::PYTHON)
            })
    }

    /// Runs it to its end; returns its output on failure.
    pub(super) fn run<I, S>(&self, arguments: I) -> Result<(), String>
    where
        I: IntoIterator<Item = S>,
        S: AsRef<OsStr>,
    {
        let output = Command::new(&self.program)
            .args(arguments)
            .env("TMPDIR", self.scratch)
            // A download installs nothing, so it needs no virtual environment.
            .env("PIP_REQUIRE_VIRTUALENV", "0")
            .stdin(Stdio::null())
            .output()
            .map_err(|error| error.to_string())?;
        if output.status.success() {
            return Ok(());
        }
        Err(String::from_utf8_lossy(&output.stderr).into())
    }

    pub(super) fn name(&self) -> String {
        self.program.to_string_lossy().into()
    }
}

fn candidates() -> Vec<OsString> {
    match env::var_os("PYTHON") {
        Some(python) if !python.is_empty() => vec![python],
        _ => vec!["python3".into(), "python".into()],
    }
}
