//! Files of weights to be taken apart and put together otherwise.

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

/// What is in it.
pub fn content(root: &Path, name: &str) -> Vec<u8> {
    fs::read(fixture(root, name)).expect("fixture")
}

/// Entries of a zip, to be put together again with sums that are right: a file
/// whose sums are wrong is refused before anybody looks at what is in it.
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
        // Names may be what a mutation made of them.
        if writer.start_file(name.as_str(), options).is_ok() {
            writer.write_all(content).expect("written");
        }
    }
    writer.finish().expect("a zip").into_inner()
}
