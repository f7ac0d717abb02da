//! Weights from a PyTorch checkpoint: a zip with a pickle that describes the tensors, and
//! a file for the numbers of each storage.
//!
//! The pickle interpreter supports tensors and their containers only ([`pickle`],
//! [`value`]); it cannot call any code.

mod bytes;
mod pickle;
mod value;

use std::{
    fmt::Display,
    io::{Cursor, Read},
};

use zip::ZipArchive;

use self::{pickle::Pickle, value::TensorView};
use super::{
    Mlp,
    error::{self, quoted},
    tensor::{Tensor, checked_count},
};

/// The signature of an entry in a zip's table of contents.
const ENTRY: &[u8] = b"PK\x01\x02";

/// The maximum number of entries in a zip; each storage takes one.
const MOST_ENTRIES: usize = 1_024;

/// The longest pickle accepted (bytes): enough for some hundred tensors.
const LONGEST_PICKLE: u64 = 1 << 18;

/// Name of the pickle in the zip's one folder.
const PICKLE: &str = "data.pkl";

/// An open checkpoint.
pub(super) struct Checkpoint<'a> {
    archive: ZipArchive<Cursor<&'a [u8]>>,
    /// The folder of all entries, with its slash.
    folder: String,
}

impl<'a> Checkpoint<'a> {
    /// Opens `content` as a zip.
    pub(super) fn open(content: &'a [u8]) -> Result<Self, String> {
        let entries = content.windows(ENTRY.len()).filter(|bytes| *bytes == ENTRY);
        if entries.count() > MOST_ENTRIES {
            return Err(no_zip(&format!("it has more than {MOST_ENTRIES} entries")));
        }
        let archive = ZipArchive::new(Cursor::new(content));
        let archive = archive.map_err(|why| no_zip(&one_line(why)))?;
        let folder = archive.file_names().find_map(|name| {
            let name = name.ok()?;
            let folder = name.strip_suffix(PICKLE)?;
            folder.ends_with('/').then(|| folder.to_owned())
        });
        let missing = || no_zip(&format!("there is no {PICKLE} in a folder"));
        let folder = folder.ok_or_else(missing)?;
        Ok(Self { archive, folder })
    }

    /// The actor in the checkpoint.
    pub(super) fn mlp(mut self) -> Result<Mlp, String> {
        self.check_byte_order()?;
        let pickle = self.entry(PICKLE, LONGEST_PICKLE)?;
        let state = Pickle::read(&pickle)?;
        Mlp::from_tensors(|name| {
            let view = state.tensor(name)?;
            self.tensor(name, view)
        })
    }

    /// Checkpoints contain their byte order since PyTorch 2.0; before that it was always
    /// this one.
    fn check_byte_order(&mut self) -> Result<(), String> {
        match self.entry("byteorder", 16) {
            Ok(order) if order != b"little" => {
                let order = quoted(&String::from_utf8_lossy(&order));
                let why = format!("its byte order is {order}, expected \"little\"");
                Err(no_zip(&why))
            }
            _ => Ok(()),
        }
    }

    /// The content of the entry `name` of the folder.
    fn entry(&mut self, name: &str, longest: u64) -> Result<Vec<u8>, String> {
        let about = |why: &str| no_zip(&format!("{}: {why}", quoted(name)));
        let path = format!("{}{name}", self.folder);
        let entry = self.archive.by_name(&path);
        let entry = entry.map_err(|why| about(&one_line(why)))?;
        // The size in the entry may be wrong, so it is only a hint.
        let hint = entry.size().min(longest) as usize;
        let mut content = Vec::with_capacity(hint);
        let read = entry.take(longest + 1).read_to_end(&mut content);
        read.map_err(|why| about(&one_line(why)))?;
        if content.len() as u64 > longest {
            return Err(about(&format!("it is longer than {longest} bytes")));
        }
        Ok(content)
    }

    /// Reads the numbers of `view` from its storage.
    fn tensor(&mut self, name: &'static str, view: &TensorView) -> Result<Tensor, String> {
        let kind = view.storage.kind;
        let Some(float) = kind.float else {
            return Err(error::kind(name, kind.name));
        };
        let count = checked_count(name, &view.shape, view.count())?;
        let path = format!("data/{}", view.storage.key);
        let bytes = self.entry(&path, crate::policy::LARGEST_FILE)?;
        let values = (0..count).map(|index| float.at(&bytes, view.place(index)?));
        let values: Option<Vec<f32>> = values.collect();
        let values = values.ok_or_else(|| {
            let found = format!("{} bytes in {}", bytes.len(), quoted(&path));
            format!("expected all numbers of {name:?}, found {found}")
        })?;
        let shape = view.shape.clone();
        Ok(Tensor { shape, values })
    }
}

fn no_zip(why: &str) -> String {
    format!("expected a PyTorch checkpoint, found a zip that is none: {why}")
}

fn one_line(why: impl Display) -> String {
    why.to_string().escape_debug().to_string()
}
