//! Shared helpers for tests of the command: folders that it runs in, and what it says there.
#![allow(dead_code)] // Each program uses its own part.

#[path = "../../../tests/support/script.rs"]
pub mod script;
#[path = "../../../tests/support/table.rs"]
pub mod table;
pub mod terminal;

use std::{
    env, fs,
    ops::Deref,
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
    sync::{Arc, Once},
};

use serde_json::Value;
use signal_hook::{
    consts::{SIGHUP, SIGINT, SIGTERM},
    flag::register,
};
use tempfile::TempDir;

/// The folder of the clone.
pub const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// The program itself.
pub const RATELAB: &str = env!("CARGO_BIN_EXE_ratelab");

/// Text that was printed.
#[derive(Debug, PartialEq, Eq)]
pub struct Said(pub String);

impl Said {
    pub fn new(bytes: &[u8]) -> Self {
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

/// The only error line of a command that has ended, with this status.
#[track_caller]
pub fn error_line(line: &str, output: &Output, code: i32) -> Said {
    let said = Said::new(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{line}: {}", said.0);
    assert_eq!(said.lines().count(), 1, "{line}: {}", said.0);
    said
}

/// A folder that ratelab runs in, removed after the test.
pub struct Folder(TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(TempDir::new().expect("a folder"))
    }

    /// With copies of these files of the clone.
    pub fn with(files: &[&str]) -> Self {
        let folder = Self::new();
        for file in files {
            let name = Path::new(file).file_name().expect("a name");
            fs::copy(Path::new(ROOT).join(file), folder.0.path().join(name)).expect("copied");
        }
        folder
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

    /// Names in the folder `name`, sorted.
    pub fn names(&self, name: &str) -> Vec<String> {
        names(self.path(name))
    }

    /// Ratelab with the words of `line`.
    pub fn command(&self, line: &str) -> Command {
        shell(self.0.path(), &format!("exec ratelab {line}"))
    }

    pub fn does(&self, line: &str) -> Output {
        self.command(line).output().expect("it starts")
    }

    /// What a command prints, which must succeed.
    #[track_caller]
    pub fn says(&self, line: &str) -> Said {
        let output = self.does(line);
        assert!(output.status.success(), "{line}: {output:?}");
        Said::new(&output.stdout)
    }

    /// The JSON that it prints, and nothing else.
    #[track_caller]
    pub fn json(&self, line: &str) -> Value {
        serde_json::from_str(&self.says(line)).expect("JSON and nothing else")
    }

    /// The only error line of a command that ends with this status, and what it printed.
    #[track_caller]
    pub fn fails(&self, line: &str, code: i32) -> (Said, Said) {
        let output = self.does(line);
        (error_line(line, &output, code), Said::new(&output.stdout))
    }

    /// Plays rows of a script.
    #[track_caller]
    pub fn plays(&self, rows: &str) {
        let faults = script::faults(rows, |line| shell(self.0.path(), line));
        assert!(faults.is_empty(), "{}", faults.join("\n"));
    }
}

/// A line of the shell in `folder`, which finds ratelab as `$RATELAB` and on its path, where its
/// examples are as well, the clone as `$CLONE`, and no files of the user.
pub fn shell(folder: &Path, line: &str) -> Command {
    assert_outside();
    heed_signals();
    let built = Path::new(RATELAB).with_file_name("");
    let path = env::var("PATH").unwrap_or_default();
    let path = format!("{0}:{0}/examples:{path}", built.display());
    let mut shell = Command::new("sh");
    shell.args(["-c", line]).current_dir(folder);
    shell.env("PATH", path).env("HOME", folder.join("home"));
    shell
        .env_remove("XDG_DATA_HOME")
        .env_remove("XDG_STATE_HOME");
    shell.env("RATELAB", RATELAB).env("CLONE", ROOT);
    shell.stdin(Stdio::null());
    shell
}

/// Names in a folder, sorted.
pub fn names(folder: impl AsRef<Path>) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder");
    let names = entries.map(|entry| entry.expect("an entry").file_name());
    let mut names: Vec<_> = names.map(|name| name.to_string_lossy().into()).collect();
    names.sort();
    names
}

/// The words of a command line; `'` around a word keeps its blanks.
pub fn words(line: &str) -> impl Iterator<Item = &str> {
    let parts = line.split('\'').zip([false, true].into_iter().cycle());
    parts.flat_map(|(part, quoted)| {
        if quoted {
            vec![part]
        } else {
            part.split_whitespace().collect()
        }
    })
}

/// Sends `signal` to process `pid`.
pub fn send(signal: &str, pid: u32) {
    let mut kill = Command::new("kill");
    let sent = kill.args([signal, &pid.to_string()]).status();
    assert!(sent.expect("kill").success());
}

/// Lets programs that the tests start heed every signal, even if the tests were started with some
/// ignored, as `nohup` and background jobs of scripts are: what has a handler here is not ignored
/// there.
fn heed_signals() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
        let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
        let ignored = ignored.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
        for signal in [SIGHUP, SIGINT, SIGTERM] {
            if ignored.unwrap_or_default() >> (signal - 1) & 1 != 0 {
                register(signal, Arc::default()).expect("a handler");
            }
        }
    });
}

/// Waits until process `pid` has a handler for SIGTERM, so that it answers to signals as ratelab.
#[cfg(target_os = "linux")]
pub fn wait_for_handlers(pid: u32) {
    const TERM: u64 = 1 << 14;
    loop {
        let status = fs::read_to_string(format!("/proc/{pid}/status")).expect("it runs");
        let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
        let caught = u64::from_str_radix(caught.expect("a mask").trim(), 16);
        if caught.expect("hexadecimal") & TERM != 0 {
            return;
        }
        std::thread::yield_now();
    }
}

/// The file by which the exercises recognise a clone.
const MARK: &str = "exercises/bands.toml";

/// # Panics
/// If folders for temporary files lie in a clone: ratelab would then use the files there.
fn assert_outside() {
    let folder = env::temp_dir();
    let clone = folder.ancestors().find(|folder| folder.join(MARK).exists());
    assert_eq!(clone, None, "set TMPDIR to a folder outside of this clone");
}
