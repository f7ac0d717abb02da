//! The tree as a `.tar.gz`.

use std::io;

use flate2::{Compression, GzBuilder};
use tar::{Builder, EntryType, Header};

use crate::{File, Tree};

/// Packs `tree` below a folder called `name`; each file has the date `time`, in seconds
/// since 1970.
///
/// # Errors
/// If a path is invalid for a tarball.
pub fn tarball(tree: &Tree, name: &str, time: u64) -> io::Result<Vec<u8>> {
    let gzip = GzBuilder::new().write(Vec::new(), Compression::best());
    let mut archive = Builder::new(gzip);
    for (path, file) in tree.files() {
        let path = format!("{name}/{path}");
        archive.append_data(&mut header(file, time), path, &file.bytes[..])?;
    }
    archive.into_inner()?.finish()
}

/// The owner is root, number 0: on unpacking, the current user becomes the owner.
fn header(file: &File, time: u64) -> Header {
    let mut header = Header::new_ustar();
    header.set_entry_type(EntryType::Regular);
    header.set_size(file.bytes.len() as u64);
    header.set_mode(file.mode());
    header.set_mtime(time);
    header.set_uid(0);
    header.set_gid(0);
    header
}
