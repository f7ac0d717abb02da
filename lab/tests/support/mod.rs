//! Shared helpers for tests of the command: folders that it runs in, and what it says there.
#![allow(dead_code)] // Each test uses its own part.

pub mod outside;
mod words;

use std::{
    fs,
    ops::Deref,
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
};

use serde_json::Value;
use tempfile::TempDir;
use words::words;

/// The folder of the clone.
pub const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// The program itself.
pub const RATELAB: &str = env!("CARGO_BIN_EXE_ratelab");

/// Text that was printed.
#[derive(Debug, PartialEq, Eq)]
pub struct Said(pub String);

impl Said {
    pub fn of(bytes: &[u8]) -> Self {
        Self(String::from_utf8(bytes.to_vec()).expect("UTF-8"))
    }

    /// Checks that `part` is in it.
    #[track_caller]
    pub fn has(&self, part: &str) -> &Self {
        assert!(self.contains(part), "{part:?} is missing in\n{}", self.0);
        self
    }

    /// Checks that `part` is not in it.
    #[track_caller]
    pub fn lacks(&self, part: &str) -> &Self {
        assert!(!self.contains(part), "{part:?} is in\n{}", self.0);
        self
    }
}

impl Deref for Said {
    type Target = str;

    fn deref(&self) -> &str {
        &self.0
    }
}

/// Somebody who uses ratelab by command lines.
pub trait User {
    /// The command, without its arguments.
    fn program(&self) -> Command;

    fn command(&self, line: &str) -> Command {
        let mut command = self.program();
        command.args(words(line)).stdin(Stdio::null());
        command
    }

    fn does(&self, line: &str) -> Output {
        self.command(line).output().expect("it starts")
    }

    /// What a command prints, which must succeed.
    #[track_caller]
    fn says(&self, line: &str) -> Said {
        let output = self.does(line);
        assert!(output.status.success(), "{line}: {output:?}");
        Said::of(&output.stdout)
    }

    /// The JSON that it prints, and nothing else.
    #[track_caller]
    fn json(&self, line: &str) -> Value {
        serde_json::from_str(&self.says(line)).expect("JSON and nothing else")
    }

    /// The only error line of a command that ends with this status, and what it printed.
    #[track_caller]
    fn fails(&self, line: &str, code: i32) -> (Said, Said) {
        let output = self.does(line);
        (error_line(line, &output, code), Said::of(&output.stdout))
    }

    /// The error line for bad input, on which nothing is printed.
    #[track_caller]
    fn refuses(&self, line: &str) -> Said {
        let (said, printed) = self.fails(line, 2);
        assert_eq!(&*printed, "", "{line}");
        said
    }

    /// Checks a table of bad input: in each row the rest of a command line that begins with
    /// `command`, and the parts of its error line, separated by ` | `.
    #[track_caller]
    fn refuses_each(&self, command: &str, table: &str) {
        for row in table.lines().filter(|row| !row.trim().is_empty()) {
            let mut cells = row.split(" | ").map(str::trim);
            let line = format!("{command} {}", cells.next().expect("a command line"));
            let said = self.refuses(&line);
            for part in cells {
                assert!(said.contains(part), "{line}: no {part:?} in {}", said.0);
            }
        }
    }
}

/// The only error line of a command that has ended, with this status.
#[track_caller]
pub fn error_line(line: &str, output: &Output, code: i32) -> Said {
    let said = Said::of(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{line}: {}", said.0);
    assert_eq!(said.lines().count(), 1, "{line}: {}", said.0);
    said
}

/// A folder that ratelab runs in, removed after the test.
pub struct Folder(pub TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(TempDir::new().expect("a folder"))
    }

    /// With copies of these files of the clone.
    pub fn with(files: &[&str]) -> Self {
        let folder = Self::new();
        folder.copy(files);
        folder
    }

    /// Copies these files of the clone into it.
    pub fn copy(&self, files: &[&str]) {
        for file in files {
            let name = Path::new(file).file_name().expect("a name");
            fs::copy(Path::new(ROOT).join(file), self.0.path().join(name)).expect("copied");
        }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Writes a file, in a folder that it makes if there is none.
    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("made");
        fs::write(path, content).expect("written");
    }

    pub fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).expect("read")
    }

    pub fn bytes(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).expect("read")
    }

    /// Makes a pipe with a name.
    pub fn make_pipe(&self, name: &str) {
        let made = Command::new("mkfifo").arg(self.path(name)).status();
        assert!(made.expect("mkfifo").success());
    }

    /// Runs a line of the shell.
    pub fn shell(&self, line: &str) -> Output {
        let mut shell = Command::new("sh");
        shell.args(["-c", line]).current_dir(self.0.path());
        shell.output().expect("sh starts")
    }

    /// Names in the folder `name`, sorted.
    pub fn names(&self, name: &str) -> Vec<String> {
        let entries = fs::read_dir(self.path(name)).expect("a folder");
        let names = entries.map(|entry| entry.expect("an entry").file_name());
        let mut names: Vec<_> = names.map(|name| name.to_string_lossy().into()).collect();
        names.sort();
        names
    }
}

impl User for Folder {
    fn program(&self) -> Command {
        let mut program = Command::new(RATELAB);
        program.current_dir(self.0.path());
        program
    }
}

/// Sends `signal` to process `pid`.
pub fn send(signal: &str, pid: u32) {
    let kill = Command::new("kill")
        .args([signal, &pid.to_string()])
        .status();
    assert!(kill.expect("kill").success());
}
