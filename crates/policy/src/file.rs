//! The file of a policy.

use ratelab::Digest;
use std::{fmt, io::ErrorKind, path::Path};

use ratelab_system::file::{self, FileError};
use serde::{Deserialize, Serialize};

use crate::{
    Activation, LARGEST_FILE, PolicyFault,
    format::{FileFormat, way_out},
    onnx::WholeGraph,
};

/// What the text of a program begins with, in logs: a reader without the file knows what it is.
const PROGRAM: &str = "exec:";

/// A file by its path and, if it is pinned, by its content. As text `path/to/file.pt`, or
/// pinned as `path/to/file.pt@sha256:…`; of a program `exec:path/to/policy.py@sha256:…`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PolicyFile {
    /// Path of the file.
    pub path: String,
    /// The digest that fixes its content.
    pub sha256: Option<Digest>,
    /// Whether it is known to be a program.
    #[serde(default, rename = "program")]
    pub is_program: bool,
    /// The activation of a network, if its name has one: `path/to/file.pt#relu`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub activation: Option<Activation>,
}

impl PolicyFile {
    /// Parses a path with an optional digest.
    pub fn parse(text: &str) -> Self {
        let file = text.trim_start_matches(PROGRAM);
        let pinned =
            Digest::split_pin(file).and_then(|(path, digest)| Some((path, Some(digest.ok()?))));
        let (path, sha256) = pinned.unwrap_or((file, None));
        let named = path.rsplit_once('#');
        let named = named.and_then(|(path, name)| Some((path, Some(name.parse().ok()?))));
        let (path, activation) = named.unwrap_or((path, None));
        Self {
            path: path.to_owned(),
            sha256,
            is_program: file != text,
            activation,
        }
    }

    /// Returns its name without the folder.
    pub fn name(&self) -> &str {
        let name = Path::new(&self.path).file_name();
        name.and_then(|name| name.to_str()).unwrap_or(&self.path)
    }

    /// Reads its content and computes the digest; an ONNX graph includes its weights in other
    /// files.
    pub(crate) fn read(&self) -> Result<(Vec<u8>, Digest), PolicyFault> {
        let path = Path::new(&self.path);
        let content = file::read(path, LARGEST_FILE).map_err(unread)?;
        let (content, found) = match FileFormat::detect(&content) {
            FileFormat::Onnx => {
                let whole = WholeGraph::read(content, path)
                    .map_err(|why| PolicyFault::Other(why.to_string()))?;
                (whole.content, whole.digest)
            }
            _ => {
                let digest = Digest::new(&content);
                (content, digest)
            }
        };
        match self.sha256 {
            Some(expected) if expected != found => Err(PolicyFault::Changed { expected, found }),
            _ => Ok((content, found)),
        }
    }
}

fn unread(why: FileError) -> PolicyFault {
    PolicyFault::Other(match why {
        FileError::Unreadable(why) if why.kind() == ErrorKind::NotFound => {
            return PolicyFault::Missing;
        }
        FileError::Unreadable(why) => {
            format!("expected a file of weights, found one that cannot be read: {why}")
        }
        FileError::NoFile(what) => {
            format!(
                "expected a file of weights, found {what}; {}",
                way_out(None)
            )
        }
        FileError::TooLarge(bytes) => format!(
            "expected a file of weights of {LARGEST_FILE} bytes at most, found {bytes} bytes; {}",
            way_out(None)
        ),
    })
}

impl fmt::Display for PolicyFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.is_program { PROGRAM } else { "" })?;
        f.write_str(&self.path)?;
        if let Some(activation) = self.activation {
            write!(f, "#{activation}")?;
        }
        match self.sha256 {
            Some(digest) => write!(f, "{}{digest}", Digest::PIN),
            None => Ok(()),
        }
    }
}
