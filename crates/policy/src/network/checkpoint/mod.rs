//! Weights from a PyTorch checkpoint: a zip with a pickle that describes the tensors, and
//! a file for the numbers of each storage.
//!
//! The pickle interpreter supports tensors and their containers only ([`pickle`],
//! [`value`]); it cannot call any code.

mod archive;
mod pickle;
mod value;

use std::{
    fmt::Display,
    io::{Cursor, Read},
};

use zip::{
    ZipArchive,
    read::{ArchiveOffset, Config},
};

use self::{archive::other_archive, pickle::Pickle, value::TensorView};
use super::{
    Mlp,
    error::{kind, quoted, unfit},
    state::NetworkSettings,
    tensor::{Tensor, checked_count},
};
use crate::{WeightsError, format::ProgramKind};
use archive::PickleError;

/// The signature of an entry in a zip's table of contents.
const ENTRY: &[u8] = b"PK\x01\x02";

/// The maximum number of entries in a zip; each storage takes one.
const MAX_ENTRIES: usize = 1_024;

/// The longest pickle accepted (bytes): enough for some hundred tensors.
const LONGEST_PICKLE: u64 = 1 << 18;

/// Name of the pickle in the zip's one folder.
const PICKLE: &str = "data.pkl";

/// Opens `content` as a zip.
///
/// The offsets in it count from its first byte: PyTorch writes records between the table of
/// contents and its end, by which a reader that looks for the first byte would be misled.
pub(super) fn archive(content: &[u8]) -> Result<ZipArchive<Cursor<&[u8]>>, WeightsError> {
    let entries = content.windows(ENTRY.len()).filter(|bytes| *bytes == ENTRY);
    if entries.count() > MAX_ENTRIES {
        return Err(no_zip(&format!("it has more than {MAX_ENTRIES} entries")));
    }
    let config = Config {
        archive_offset: ArchiveOffset::Known(0),
    };
    ZipArchive::with_config(config, Cursor::new(content)).map_err(|why| no_zip(&one_line(why)))
}

/// Returns the names of all entries.
pub(super) fn names(archive: &ZipArchive<Cursor<&[u8]>>) -> Vec<String> {
    archive
        .file_names()
        .filter_map(Result::ok)
        .map(|name| name.to_string())
        .collect()
}

/// Returns the content of the entry `path`.
pub(super) fn entry(
    archive: &mut ZipArchive<Cursor<&[u8]>>,
    path: &str,
    longest: u64,
) -> Result<Vec<u8>, String> {
    let entry = archive.by_name(path).map_err(one_line)?;
    // The size in the entry may be wrong, so it is only a hint.
    let hint = entry.size().min(longest) as usize;
    let mut content = Vec::with_capacity(hint);
    let read = entry.take(longest + 1).read_to_end(&mut content);
    read.map_err(one_line)?;
    if content.len() as u64 > longest {
        return Err(format!("it is longer than {longest} bytes"));
    }
    Ok(content)
}

/// An open checkpoint.
pub(super) struct Checkpoint<'a> {
    archive: ZipArchive<Cursor<&'a [u8]>>,
    /// The folder of all entries, with its slash.
    folder: String,
}

impl<'a> Checkpoint<'a> {
    /// Opens `content` as a zip.
    pub(super) fn open(content: &'a [u8]) -> Result<Self, WeightsError> {
        let archive = archive(content)?;
        let names = names(&archive);
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        if let Some(other) = other_archive(&names) {
            return Err(other);
        }
        let folder = names.iter().find_map(|name| {
            let folder = name.strip_suffix(PICKLE)?;
            folder.ends_with('/').then(|| folder.to_owned())
        });
        let missing = || WeightsError::Unfit {
            why: format!("{NO_CHECKPOINT}: there is no {PICKLE} in a folder"),
            program: None,
        };
        Ok(Self {
            archive,
            folder: folder.ok_or_else(missing)?,
        })
    }

    /// Returns the network in the checkpoint: in its dictionary, or in one within that.
    pub(super) fn mlp(mut self, settings: NetworkSettings) -> Result<Mlp, WeightsError> {
        self.check_byte_order()?;
        let pickle = self.entry(PICKLE, LONGEST_PICKLE)?;
        let outer = Pickle::read(&pickle)?;
        let around = outer.items();
        let mut inner = if around.has_policy(settings) {
            Vec::new()
        } else {
            outer.inner()
        };
        inner.retain(|(_, state)| state.items().has_policy(settings));
        let Some((name, state)) = inner.first() else {
            return self.network(&outer, settings);
        };
        around.check_around(name)?;
        let activation = match settings.activation {
            None => around.activation()?,
            given => given,
        };
        let settings = NetworkSettings {
            activation,
            ..settings
        };
        self.network(state, settings)
    }

    /// Returns the network in the dictionary `state`.
    fn network(
        &mut self,
        state: &Pickle<'_>,
        settings: NetworkSettings,
    ) -> Result<Mlp, WeightsError> {
        let items = state.items();
        items.network(settings, |name| {
            let view = state.tensor(name).ok_or_else(|| items.missing(name))?;
            self.tensor(name, view)
        })
    }

    /// Checkpoints contain their byte order since PyTorch 2.0; before that it was always
    /// this one.
    fn check_byte_order(&mut self) -> Result<(), WeightsError> {
        match self.entry("byteorder", 16) {
            Ok(order) if order != b"little" => {
                let order = quoted(&String::from_utf8_lossy(&order));
                let why = format!("its byte order is {order}, expected \"little\"");
                Err(no_zip(&why))
            }
            _ => Ok(()),
        }
    }

    /// Returns the content of the entry `name` of the folder.
    fn entry(&mut self, name: &str, longest: u64) -> Result<Vec<u8>, WeightsError> {
        let path = format!("{}{name}", self.folder);
        entry(&mut self.archive, &path, longest)
            .map_err(|why| no_zip(&format!("{}: {why}", quoted(name))))
    }

    /// Reads the numbers of `view` from its storage.
    fn tensor(&mut self, name: &str, view: &TensorView) -> Result<Tensor, WeightsError> {
        let element = view.storage.kind;
        let Some(float) = element.float else {
            return Err(kind(name, element.name));
        };
        let count = checked_count(name, &view.shape, view.count())?;
        let path = format!("data/{}", view.storage.key);
        let bytes = self.entry(&path, crate::LARGEST_FILE)?;
        let values = (0..count).map(|index| float.at(&bytes, view.place(index)?));
        let complete: Option<Vec<f32>> = values.collect();
        let values = complete.ok_or_else(|| {
            let found = format!("{} bytes in {}", bytes.len(), quoted(&path));
            WeightsError::Damaged(format!("expected all numbers of {name:?}, found {found}"))
        })?;
        let shape = view.shape.clone();
        Ok(Tensor { shape, values })
    }
}

/// The first object of a checkpoint in the format before PyTorch 1.6.
const LEGACY: &[u8] = b"\x80\x02\x8a\x0a\x6c\xfc\x9c\x46\xf9\x20\x6a\xa8\x50\x19";

/// Returns the error for the pickle `content` that has no zip around it.
pub(super) fn bare_pickle(content: &[u8]) -> WeightsError {
    if content.starts_with(LEGACY) {
        return WeightsError::Damaged(
            "expected a PyTorch checkpoint that is a zip, found one as PyTorch wrote before 1.6: \
             load it there and save it again"
                .to_owned(),
        );
    }
    let beginning = &content[..content.len().min(LONGEST_PICKLE as usize)];
    let expected = "expected a PyTorch checkpoint, found a Python pickle";
    match Pickle::read(beginning) {
        Err(PickleError::Code { what, .. }) if what.contains(NORMALISER) => WeightsError::Unfit {
            why: format!("{expected} of {what}: statistics of a normaliser, not a policy"),
            program: Some(ProgramKind::Sb3),
        },
        Err(PickleError::Code { what, .. }) => unfit(format!("{expected} that asks for {what}")),
        _ => unfit(expected.to_owned()),
    }
}

/// The class of a normaliser of Stable-Baselines3.
const NORMALISER: &str = "stable_baselines3.common.vec_env.vec_normalize.VecNormalize";

/// The beginning of what is wrong with a zip.
const NO_CHECKPOINT: &str = "expected a PyTorch checkpoint, found a zip that is not one";

fn no_zip(why: &str) -> WeightsError {
    WeightsError::Damaged(format!("{NO_CHECKPOINT}: {why}"))
}

fn one_line(why: impl Display) -> String {
    why.to_string().escape_debug().to_string()
}
