//! What an existing file must be, so that a new one may replace it.

use std::{
    fs::File,
    io::{self, Read},
    path::Path,
};

use super::live::must_be_live;
use crate::error::Error;

/// A kind of result. It replaces an earlier file of its kind, and nothing else.
#[derive(Clone, Copy)]
pub enum OutputKind<'a> {
    /// Rows below this header.
    Rows(&'a str),
    /// A drawing in SVG.
    Drawing,
    /// A page for the browser.
    Page,
    /// A trace for Perfetto.
    Trace,
    /// Tests with their results, as JUnit has them.
    Tests,
}

impl OutputKind<'_> {
    /// Refuses an existing file at `path`, which `option` named, that is of another kind.
    /// One that was cut off, or is empty, is not.
    ///
    /// # Errors
    /// [`Error::BadInput`] if it is, or cannot be read.
    pub fn check(self, option: &str, path: &Path) -> Result<(), Error> {
        if !path.is_file() || must_be_live(path) {
            return Ok(());
        }
        let (name, beginning) = self.about();
        let found = first_bytes(path, beginning.len());
        let found = found.map_err(|why| Error::unwritable(option, path, &why))?;
        if beginning.starts_with(&found) {
            return Ok(());
        }
        Err(Error::BadInput(format!(
            "{option} {}: there is such a file, and it is no {name} of this command: choose another name",
            path.display()
        )))
    }

    /// Its name, and the first bytes of every file of it.
    fn about(&self) -> (&'static str, &[u8]) {
        match self {
            Self::Rows(header) => ("CSV", header.as_bytes()),
            Self::Drawing => ("SVG", b"<svg xmlns=\"http://www.w3.org/2000/svg\" "),
            Self::Page => (
                "page",
                b"<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n",
            ),
            Self::Tests => (
                "JUnit",
                b"<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuite ",
            ),
            // The packet that describes the track of the nodes.
            Self::Trace => (
                "trace",
                b"\x0a\x12\x50\x01\xe2\x03\x0d\x08\x01\x12\x05nodes",
            ),
        }
    }
}

fn first_bytes(path: &Path, count: usize) -> io::Result<Vec<u8>> {
    let mut found = Vec::new();
    File::open(path)?
        .take(count as u64)
        .read_to_end(&mut found)?;
    Ok(found)
}
