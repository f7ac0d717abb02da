//! Files of weights, to be taken apart and reassembled.

use std::{
    fs,
    io::{Cursor, Read, Write},
    path::{Path, PathBuf},
};

use zip::{CompressionMethod, ZipArchive, ZipWriter, write::SimpleFileOptions};

/// The fixture called `name`, in the clone at `root`.
pub fn fixture(root: &Path, name: &str) -> PathBuf {
    root.join("tests/fixtures/policies").join(name)
}

/// The content of the fixture.
pub fn content(root: &Path, name: &str) -> Vec<u8> {
    fs::read(fixture(root, name)).expect("fixture")
}

/// The entries of a zip, for a new zip with correct checksums: a file with wrong ones
/// would be refused before its content is read.
pub fn entries(content: &[u8]) -> Vec<(String, Vec<u8>)> {
    let mut archive = ZipArchive::new(Cursor::new(content)).expect("a zip");
    let count = archive.len();
    let entry = |index| {
        let mut entry = archive.by_index(index).expect("an entry");
        let mut content = Vec::new();
        entry.read_to_end(&mut content).expect("content");
        (entry.name().expect("a name").into_owned(), content)
    };
    (0..count).map(entry).collect()
}

/// A zip of `entries`.
pub fn zipped(entries: &[(String, Vec<u8>)]) -> Vec<u8> {
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    for (name, content) in entries {
        // A mutation may have made an invalid name.
        if writer.start_file(name.as_str(), options).is_ok() {
            writer.write_all(content).expect("written");
        }
    }
    writer.finish().expect("a zip").into_inner()
}
