//! MuJoCo's wheel, and the Python that downloads it.

use std::{
    env,
    ffi::{OsStr, OsString},
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use super::error::{Error, Scratch, remedy};

/// The wheel is the same for every Python version, so this names the newest one of the
/// release, regardless of the user's.
const DOWNLOAD: &str = "-m pip download --quiet --no-input --disable-pip-version-check \
    --retries 2 --no-deps --only-binary=:all: --require-hashes \
    --python-version 3.12 --implementation cp --abi cp312";

/// Arguments: the wheel, the file in it, and the target folder.
const UNPACK: &str = "import sys, zipfile; \
    zipfile.ZipFile(sys.argv[1]).extract(sys.argv[2], sys.argv[3])";

/// Downloads the pinned wheel for pip's platform `tag`.
pub(super) fn download(
    python: &Python,
    requirements: &Path,
    tag: &str,
    scratch: &Scratch,
) -> Result<PathBuf, Error> {
    let arguments = DOWNLOAD.split_whitespace().map(OsStr::new).chain([
        OsStr::new("--platform"),
        OsStr::new(tag),
        OsStr::new("--requirement"),
        requirements.as_os_str(),
        OsStr::new("--dest"),
        scratch.path().as_os_str(),
    ]);
    python
        .run(arguments)
        .map_err(|said| download_error(python, requirements, &said))?;
    find_wheel(scratch.path()).ok_or_else(|| Error::download("no wheel came"))
}

/// Unpacks the file `member`; Python checks its checksum.
pub(super) fn unpack(
    python: &Python,
    wheel: &Path,
    member: &str,
    scratch: &Scratch,
) -> Result<PathBuf, Error> {
    let arguments = [
        OsStr::new("-c"),
        OsStr::new(UNPACK),
        wheel.as_os_str(),
        OsStr::new(member),
        scratch.path().as_os_str(),
    ];
    python.run(arguments).map_err(|said| {
        let said = last_line(&said);
        let cause = format!("its wheel could not be unpacked ({said}).");
        Error::new(cause, remedy::SPACE)
    })?;
    Ok(scratch.path().join(member))
}

fn find_wheel(folder: &Path) -> Option<PathBuf> {
    let entries = fs::read_dir(folder).ok()?.flatten();
    entries
        .map(|entry| entry.path())
        .find(|path| path.extension().is_some_and(|extension| extension == "whl"))
}

/// Distinguishes failures with different remedies.
fn download_error(python: &Python, requirements: &Path, said: &str) -> Error {
    if said.contains("No module named pip") {
        Error::new(format!("{} has no pip.", python.name()), remedy::PIP)
    } else if said.contains("DO NOT MATCH THE HASHES") {
        let (pin, said) = (requirements.display(), last_line(said));
        let cause = format!("the wheel that came is not the one pinned in {pin} ({said}).");
        Error::new(cause, remedy::INDEX)
    } else if said.contains("connection broken by") {
        // pip's own last line would name the wrong cause: "No matching distribution".
        Error::download("no connection to the package index")
    } else {
        Error::download(&last_line(said))
    }
}

/// Returns the last line, in which pip and Python give the cause.
fn last_line(said: &str) -> String {
    let last = said.lines().rfind(|line| !line.trim().is_empty());
    let words: Vec<_> = last
        .unwrap_or("it said nothing")
        .split_whitespace()
        .collect();
    words.join(" ")
}

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
