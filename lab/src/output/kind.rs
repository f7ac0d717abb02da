//! What an existing file must be, so that a new one may replace it.

use std::{
    fs::File,
    io::{self, Read},
    path::Path,
};

use ratelab_system::file::read;

use super::live::must_be_live;
use crate::{error::Error, trace::is_trace};

/// A kind of result. It replaces an earlier file of its kind, and nothing else.
#[derive(Clone, Copy)]
pub enum OutputKind<'a> {
    /// Rows below this header.
    Rows(&'a str),
    /// The figures of runs, as JSON.
    Figures,
    /// A drawing in SVG.
    Drawing,
    /// A page for the browser.
    Page,
    /// A trace for Perfetto.
    Trace,
    /// Tests with their results, as JUnit has them.
    Tests,
    /// A page of the manual.
    Manual,
}

/// How the files of a kind are known.
struct KindMark<'a> {
    /// Their name, with its article.
    name: &'static str,
    /// Their first bytes.
    beginning: &'a [u8],
    /// What comes soon after that, in files of this program alone.
    mark: &'static str,
}

/// Bytes of a file in which its mark stands.
const SOON: u64 = 1 << 18;

/// The longest trace that is replaced (bytes): it is read as a whole, because what follows the
/// beginning of one may be something else.
const LONGEST: u64 = 1 << 30;

impl OutputKind<'_> {
    /// Refuses an existing file at `path`, which `option` named, that is of another kind.
    /// One that was cut off at its beginning, or is empty, is not.
    ///
    /// # Errors
    /// [`Error::BadInput`] if it is, or cannot be read.
    pub fn check(self, option: &str, path: &Path) -> Result<(), Error> {
        if !path.is_file() || must_be_live(path) {
            return Ok(());
        }
        let is_ours = self.is_file(path);
        if is_ours.map_err(|why| Error::unwritable(option, path, &why))? {
            return Ok(());
        }
        Err(Error::BadInput(format!(
            "{option} {}: there is such a file, and it is not {} of this command: choose another name",
            path.display(),
            self.mark().name
        )))
    }

    /// Returns whether the file at `path` is one of this kind.
    fn is_file(self, path: &Path) -> io::Result<bool> {
        let KindMark {
            beginning, mark, ..
        } = self.mark();
        let mut found = Vec::new();
        File::open(path)?.take(SOON).read_to_end(&mut found)?;
        let Some(rest) = found.strip_prefix(beginning) else {
            return Ok(beginning.starts_with(&found));
        };
        let marked = mark.is_empty() || String::from_utf8_lossy(rest).contains(mark);
        match self {
            Self::Trace => Ok(read(path, LONGEST).is_ok_and(|bytes| is_trace(&bytes))),
            _ => Ok(marked),
        }
    }

    /// Returns how its files are known.
    fn mark(&self) -> KindMark<'_> {
        let (name, beginning, mark): (_, &[u8], _) = match self {
            Self::Rows(header) => ("a CSV file", header.as_bytes(), ""),
            Self::Figures => ("a JSON file", b"{\n  \"", "\"cause_of_end\": \""),
            Self::Drawing => (
                "an SVG file",
                b"<svg xmlns=\"http://www.w3.org/2000/svg\" ",
                "font-family=\"DejaVu Sans Mono, Menlo, Consolas, monospace\"",
            ),
            Self::Page => (
                "a page",
                b"<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n",
                ": recorded runs</title>",
            ),
            Self::Tests => (
                "a JUnit file",
                b"<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuite ",
                "name=\"verdict\">",
            ),
            // The packet that describes the track of the nodes.
            Self::Trace => (
                "a trace",
                b"\x0a\x12\x50\x01\xe2\x03\x0d\x08\x01\x12\x05nodes",
                "",
            ),
            Self::Manual => (
                "a manual page",
                b".ie \\n(.g .ds Aq \\(aq\n.el .ds Aq '\n.TH ",
                "\"ratelab ",
            ),
        };
        KindMark {
            name,
            beginning,
            mark,
        }
    }
}
