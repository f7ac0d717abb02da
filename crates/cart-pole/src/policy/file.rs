//! The file of a policy.

use std::{fmt, io::ErrorKind, path::Path};

use ratelab_study::file::{self, FileError};
use serde::{Deserialize, Serialize};

use super::{Digest, LARGEST_FILE};

/// Separator between path and digest in a text, as in pinned container images.
const PIN: &str = "@sha256:";

/// What the text of a program begins with, in logs: a reader without the file knows what it is.
const PROGRAM: &str = "exec:";

/// A file by its path and, if it is pinned, by its content. As text `path/to/file.pt`, or
/// pinned as `path/to/file.pt@sha256:…`; of a program `exec:path/to/policy.py@sha256:…`.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct PolicyFile {
    path: String,
    sha256: Option<Digest>,
    /// Whether it is known to be a program.
    #[serde(default)]
    program: bool,
}

impl PolicyFile {
    /// Parses a path with an optional digest.
    pub(super) fn parse(text: &str) -> Self {
        if let Some(program) = text.strip_prefix(PROGRAM) {
            return Self::parse(program).into_program();
        }
        let pinned = text.rsplit_once(PIN);
        let pinned = pinned.and_then(|(path, digest)| Some((path, digest.parse().ok()?)));
        match pinned {
            Some((path, sha256)) => Self::new(path, Some(sha256)),
            None => Self::new(text, None),
        }
    }

    pub(super) fn new(path: &str, sha256: Option<Digest>) -> Self {
        Self {
            path: path.to_owned(),
            sha256,
            program: false,
        }
    }

    /// The same file, known to be a program.
    pub(super) fn into_program(self) -> Self {
        let program = true;
        Self { program, ..self }
    }

    /// Whether it is known to be a program.
    pub fn is_program(&self) -> bool {
        self.program
    }

    /// Path of the file.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// The digest that fixes its content.
    pub fn digest(&self) -> Option<Digest> {
        self.sha256
    }

    /// Whether its content is fixed by a digest.
    pub fn is_pinned(&self) -> bool {
        self.sha256.is_some()
    }

    /// Reads its content.
    pub(super) fn read(&self) -> Result<(Vec<u8>, Digest), String> {
        let content = file::read(Path::new(&self.path), LARGEST_FILE).map_err(unread)?;
        let found = Digest::of(&content);
        match self.sha256 {
            Some(expected) if expected != found => Err(format!(
                "expected the content with the SHA-256 {expected}, found another one: {found}"
            )),
            _ => Ok((content, found)),
        }
    }
}

fn unread(why: FileError) -> String {
    match why {
        FileError::Unreadable(why) if why.kind() == ErrorKind::NotFound => {
            "expected scripted, zero, random, lqr, a file of weights or a program; found neither a policy nor \
             a file of that name"
                .to_owned()
        }
        FileError::Unreadable(why) => {
            format!("expected a file of weights, found one that cannot be read: {why}")
        }
        FileError::NoFile(what) => format!("expected a file of weights, found {what}"),
        FileError::TooLarge(bytes) => format!(
            "expected a file of weights of {LARGEST_FILE} bytes at most, found {bytes} bytes"
        ),
    }
}

impl fmt::Display for PolicyFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.program { PROGRAM } else { "" })?;
        match self.sha256 {
            Some(digest) => write!(f, "{}{PIN}{digest}", self.path),
            None => f.write_str(&self.path),
        }
    }
}
