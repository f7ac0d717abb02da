//! Which files a model reads: none outside of the folder of its graph file.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
};

use crate::model_error::RobotModelError;

/// The most bytes of all files of a model.
const MOST_BYTES: u64 = 64 << 20;

/// Attributes with a folder that MuJoCo puts before names of files.
const FOLDERS: [&str; 3] = ["meshdir", "texturedir", "assetdir"];

/// Checks the files of the model at `mjcf` in `folder`, and returns its absolute path.
///
/// MuJoCo looks for a file in several places. All of them are looked at, so a file outside of the
/// folder is refused before MuJoCo could read it.
///
/// # Errors
/// [`RobotModelError`] for a missing file, files outside of the folder, and too many bytes.
pub(crate) fn checked(folder: &Path, mjcf: &str) -> Result<PathBuf, RobotModelError> {
    let missing = |_| RobotModelError::Missing(mjcf.to_owned());
    let root = fs::canonicalize(folder).map_err(missing)?;
    let path = root.join(mjcf);
    let real = fs::canonicalize(&path).map_err(missing)?;
    if !real.is_file() {
        return Err(RobotModelError::Missing(mjcf.to_owned()));
    }
    let mut files = Files {
        main: path.parent().unwrap_or(&root).to_owned(),
        root,
        seen: BTreeSet::new(),
        bytes: 0,
        folders: vec![PathBuf::new()],
    };
    // A file may be named before the folder that stands before its name.
    let mut known = 0;
    while known < files.folders.len() {
        known = files.folders.len();
        files.seen.clear();
        files.bytes = 0;
        files.look(&path)?;
    }
    Ok(path)
}

/// The files that were found so far.
struct Files {
    root: PathBuf,
    /// The folder of the model.
    main: PathBuf,
    seen: BTreeSet<PathBuf>,
    bytes: u64,
    /// The folders that stand before names of files.
    folders: Vec<PathBuf>,
}

impl Files {
    /// Looks at the file at `path`, and at all files that it names.
    fn look(&mut self, path: &Path) -> Result<(), RobotModelError> {
        let Ok(real) = fs::canonicalize(path) else {
            return Ok(()); // MuJoCo does not find it there either.
        };
        if !real.starts_with(&self.root) {
            return Err(RobotModelError::Outside(path.display().to_string()));
        }
        if !real.is_file() || !self.seen.insert(real.clone()) {
            return Ok(());
        }
        self.bytes += real.metadata().map_or(0, |file| file.len());
        if self.bytes > MOST_BYTES {
            return Err(RobotModelError::Files(MOST_BYTES >> 20));
        }
        let content = fs::read(&real).unwrap_or_default();
        if !is_xml(&content) {
            return Ok(());
        }
        let text = without_comments(&String::from_utf8_lossy(&content));
        if text.contains("<plugin") || text.contains("<extension") {
            return Err(RobotModelError::Plugin);
        }
        let attributes = attributes(&text);
        for (_, folder) in attributes.iter().filter(|(name, _)| FOLDERS.contains(name)) {
            if !self.folders.iter().any(|known| known == Path::new(folder)) {
                self.folders.push(folder.into());
            }
        }
        let beside = path.parent().unwrap_or(&self.main).to_owned();
        for (_, file) in attributes
            .iter()
            .filter(|(name, _)| name.starts_with("file"))
        {
            let names = [
                Path::new(file),
                Path::new(Path::new(file).file_name().unwrap_or_default()),
            ];
            for folder in self.folders.clone() {
                for base in [self.main.clone(), beside.clone()] {
                    for name in names {
                        self.look(&base.join(&folder).join(name))?;
                    }
                }
            }
        }
        Ok(())
    }
}

/// Returns whether a file is XML: its first character that is no blank opens a tag.
fn is_xml(content: &[u8]) -> bool {
    content
        .strip_prefix(b"\xef\xbb\xbf")
        .unwrap_or(content)
        .trim_ascii_start()
        .starts_with(b"<")
}

fn without_comments(text: &str) -> String {
    let mut parts = text.split("<!--");
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |so_far, part| {
        so_far + part.split_once("-->").map_or("", |(_, after)| after)
    })
}

/// Returns all attributes in a text, whatever their elements are.
fn attributes(text: &str) -> Vec<(&str, String)> {
    let mut found = Vec::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('=') {
        let name = before
            .trim_end()
            .rsplit(|c: char| !(c.is_alphanumeric() || c == '_'))
            .next();
        let value = after.trim_start();
        let quote = value.chars().next().filter(|c| ['"', '\''].contains(c));
        let quoted = quote.and_then(|quote| value[1..].split_once(quote));
        match (name, quoted) {
            (Some(name), Some((value, after))) => {
                found.push((name, decoded(value)));
                rest = after;
            }
            _ => rest = after,
        }
    }
    found
}

/// Returns the characters of an attribute, with its entities resolved.
fn decoded(value: &str) -> String {
    let mut parts = value.split('&');
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (entity, after) = part.split_once(';').unwrap_or(("", part));
        let number = |digits: &str, radix| u32::from_str_radix(digits, radix).ok();
        let code = match entity.strip_prefix('#') {
            Some(hex) if hex.starts_with(['x', 'X']) => number(&hex[1..], 16),
            Some(decimal) => number(decimal, 10),
            None => {
                let known = [
                    ("amp", '&'),
                    ("lt", '<'),
                    ("gt", '>'),
                    ("quot", '"'),
                    ("apos", '\''),
                ];
                known
                    .iter()
                    .find(|(name, _)| *name == entity)
                    .map(|(_, character)| u32::from(*character))
            }
        };
        text.extend(code.and_then(char::from_u32));
        text.push_str(after);
    }
    text
}
