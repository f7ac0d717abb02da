//! Weights of an ONNX graph in files beside it, as PyTorch exports them since 2.9
//! (`policy.onnx` and `policy.onnx.data`).
//!
//! They are read from the folder of the graph alone and put into a copy of the graph, which needs
//! no file then. Where the graph is a link, as in the cache of Hugging Face, the folder of its target
//! counts as well.

use ratelab::Digest;
use std::{
    collections::{BTreeMap, btree_map::Entry},
    io::{self, ErrorKind},
    path::{Component, Path, PathBuf},
};

use ratelab_system::file::{self, FileError, folder_of};
use thiserror::Error;

use super::wire::{WireField, WireFields, WireValue, put_bytes};
use crate::LARGEST_FILE;

/// The deepest message that is looked into: that of protocol buffers themselves.
const DEEPEST: usize = 100;

/// An ONNX graph that needs no other file.
pub(crate) struct WholeGraph {
    /// The graph, in the format of its file.
    pub(crate) content: Vec<u8>,
    /// The digest of all that the graph was made of: of its file if that is all; else of a text
    /// with the digest of the graph's file and of the other files, sorted by name, a line each.
    pub(crate) digest: Digest,
}

/// Why the weights of a graph were not read.
#[derive(Debug, Error)]
pub(crate) enum ExternalError {
    /// The file is not in the format of ONNX.
    #[error("expected an ONNX graph, found a damaged file")]
    Damaged,
    /// A tensor is said to be in a file without a name.
    #[error("expected the weights of {0:?}, found neither numbers nor the name of a file")]
    NoLocation(String),
    /// A file that is not in the folder of the graph.
    #[error(
        "its weights are in {0:?}, and they are read from the folder of the graph alone: put both \
         files into one folder and export again"
    )]
    Outside(String),
    /// A file that cannot be read.
    #[error("its weights are in {location:?}, which {why}: keep it beside the graph")]
    Unread {
        /// The name of the file, as in the graph.
        location: String,
        /// What is wrong with it.
        why: String,
    },
    /// A tensor is beyond the end of its file.
    #[error(
        "expected bytes {begin} to {end} of {location:?} for {tensor:?}, found {length} bytes: the \
         two files do not belong together"
    )]
    Short {
        /// The name of the tensor.
        tensor: String,
        /// The name of the file.
        location: String,
        /// Where the tensor begins in it.
        begin: u64,
        /// Where the tensor ends.
        end: u64,
        /// The length of the file.
        length: usize,
    },
    /// More weights than any policy has.
    #[error("expected a graph with weights of {LARGEST_FILE} bytes at most, found more")]
    TooLarge,
}

impl WholeGraph {
    /// Puts the weights from files beside `path` into the graph in that file, which has this
    /// `content`.
    ///
    /// # Errors
    /// [`ExternalError`] if the weights are elsewhere, or cannot be read.
    pub(crate) fn read(content: Vec<u8>, path: &Path) -> Result<Self, ExternalError> {
        let mut reader = Reader {
            graph: path,
            files: BTreeMap::new(),
            put: 0,
        };
        let whole = reader.whole(OnnxMessage::Model, &content, 0)?;
        let digest = Digest::new(&content);
        if reader.files.is_empty() {
            return Ok(Self { content, digest });
        }
        let files = reader.files.values().map(|file| Digest::new(file));
        let lines: String = [digest]
            .into_iter()
            .chain(files)
            .map(|digest| format!("{digest}\n"))
            .collect();
        Ok(Self {
            content: whole,
            digest: Digest::new(lines.as_bytes()),
        })
    }
}

/// The messages of an ONNX file in which tensors can be.
#[derive(Clone, Copy)]
enum OnnxMessage {
    Model,
    Training,
    Function,
    Graph,
    Node,
    Attribute,
    Sparse,
    Tensor,
}

impl OnnxMessage {
    /// Returns the message in field `number`. Source of the numbers: `onnx.proto3`.
    fn within(self, number: u64) -> Option<Self> {
        match (self, number) {
            (Self::Model, 7) | (Self::Training, 1 | 2) | (Self::Attribute, 6 | 11) => {
                Some(Self::Graph)
            }
            (Self::Model, 20) => Some(Self::Training),
            (Self::Model, 25) => Some(Self::Function),
            (Self::Function, 7) | (Self::Graph, 1) => Some(Self::Node),
            (Self::Function, 11) | (Self::Node, 5) => Some(Self::Attribute),
            (Self::Graph, 15) | (Self::Attribute, 22 | 23) => Some(Self::Sparse),
            (Self::Graph, 5) | (Self::Attribute, 5 | 10) | (Self::Sparse, 1 | 2) => {
                Some(Self::Tensor)
            }
            _ => None,
        }
    }
}

/// Field of a tensor: its name.
const NAME: u64 = 8;
/// Field of a tensor: its numbers.
const NUMBERS: u64 = 9;
/// Field of a tensor: pairs of texts that say where its numbers are.
const EXTERNAL: u64 = 13;
/// Field of a tensor: whether they are in another file, which is 1.
const LOCATION: u64 = 14;

/// Returns the fields of a message.
fn fields(bytes: &[u8]) -> impl Iterator<Item = Result<WireField<'_>, ExternalError>> {
    WireFields::new(bytes).map(|field| field.ok_or(ExternalError::Damaged))
}

/// Returns whether the numbers of the tensor in `bytes` are in another file; the last word counts.
fn is_elsewhere(bytes: &[u8]) -> Result<bool, ExternalError> {
    fields(bytes).try_fold(false, |is_elsewhere, field| {
        let field = field?;
        match field.number {
            LOCATION => Ok(matches!(field.value, WireValue::Varint(1))),
            _ => Ok(is_elsewhere),
        }
    })
}

/// Reads the weights of a graph.
struct Reader<'f> {
    /// The path of the graph.
    graph: &'f Path,
    /// The content of each file, by its name in the graph.
    files: BTreeMap<String, Vec<u8>>,
    /// Bytes put into the graph.
    put: u64,
}

impl Reader<'_> {
    /// Returns the `bytes` of a message, with all numbers in it.
    fn whole(
        &mut self,
        message: OnnxMessage,
        bytes: &[u8],
        depth: usize,
    ) -> Result<Vec<u8>, ExternalError> {
        if depth > DEEPEST {
            return Err(ExternalError::Damaged);
        }
        if matches!(message, OnnxMessage::Tensor) && is_elsewhere(bytes)? {
            return self.tensor(bytes);
        }
        let mut whole = Vec::with_capacity(bytes.len());
        for field in fields(bytes) {
            let field = field?;
            match (message.within(field.number), field.value) {
                (Some(inner), WireValue::Bytes(bytes)) => {
                    let inner = self.whole(inner, bytes, depth + 1)?;
                    put_bytes(&mut whole, field.number, &inner);
                }
                _ => whole.extend_from_slice(field.bytes),
            }
        }
        Ok(whole)
    }

    /// Returns a tensor with its numbers in place of the name of their file.
    fn tensor(&mut self, bytes: &[u8]) -> Result<Vec<u8>, ExternalError> {
        let mut tensor = Vec::new();
        let (mut name, mut place) = (String::new(), ExternalPlace::default());
        for field in fields(bytes) {
            let field = field?;
            match (field.number, field.value) {
                (EXTERNAL, WireValue::Bytes(pair)) => place.set(pair)?,
                (EXTERNAL | LOCATION | NUMBERS, _) => {}
                (NAME, WireValue::Bytes(text)) => {
                    name = String::from_utf8_lossy(text).into_owned();
                    tensor.extend_from_slice(field.bytes);
                }
                _ => tensor.extend_from_slice(field.bytes),
            }
        }
        let Some(location) = place.location else {
            return Err(ExternalError::NoLocation(name));
        };
        let file = self.file(&location)?;
        let begin = place.offset;
        let end = place
            .length
            .map_or(file.len() as u64, |length| begin.saturating_add(length));
        let numbers = usize::try_from(begin).ok().zip(usize::try_from(end).ok());
        let Some(numbers) = numbers.and_then(|(begin, end)| file.get(begin..end)) else {
            return Err(ExternalError::Short {
                tensor: name,
                begin,
                end,
                length: file.len(),
                location,
            });
        };
        put_bytes(&mut tensor, NUMBERS, numbers);
        // Many tensors may be said to have the same bytes.
        self.put += end - begin;
        if self.put > LARGEST_FILE {
            return Err(ExternalError::TooLarge);
        }
        Ok(tensor)
    }

    /// Returns the content of the file at `location` beside the graph.
    fn file(&mut self, location: &str) -> Result<&[u8], ExternalError> {
        match self.files.entry(location.to_owned()) {
            Entry::Occupied(known) => Ok(known.into_mut()),
            Entry::Vacant(new) => Ok(new.insert(read(self.graph, location)?)),
        }
    }
}

/// Reads the file at `location` beside the `graph`, in whose folder it must be whatever its parts are
/// links to. Where the graph is a link, it may also be in the folder of its target: by a link, as the
/// graph is there, or beside the target.
fn read(graph: &Path, location: &str) -> Result<Vec<u8>, ExternalError> {
    let outside = || ExternalError::Outside(location.to_owned());
    let unread = |why: String| ExternalError::Unread {
        location: location.to_owned(),
        why,
    };
    let failed = |why: io::Error| match why.kind() {
        ErrorKind::NotFound => unread("is missing".to_owned()),
        _ => unread(format!("cannot be read ({why})")),
    };
    let mut parts = Path::new(location).components();
    if !parts.all(|part| matches!(part, Component::Normal(_) | Component::CurDir)) {
        return Err(outside());
    }
    let folders = folders_of(graph).map_err(failed)?;
    let path = found_in(&folders, location).map_err(failed)?;
    if !folders.iter().any(|folder| path.starts_with(folder)) {
        return Err(outside());
    }
    file::read(&path, LARGEST_FILE).map_err(|why| match why {
        FileError::Unreadable(why) => failed(why),
        FileError::NoFile(what) => unread(format!("is {what}")),
        FileError::TooLarge(_) => ExternalError::TooLarge,
    })
}

/// Returns the folder of the `graph`, and that of the file to which it may be a link.
fn folders_of(graph: &Path) -> io::Result<[PathBuf; 2]> {
    let target = graph.canonicalize()?;
    let folder = folder_of(graph).canonicalize()?;
    Ok([folder, folder_of(&target).to_owned()])
}

/// Returns the path, without links, of the file at `location` in the first of these folders that
/// has it.
fn found_in(folders: &[PathBuf; 2], location: &str) -> io::Result<PathBuf> {
    let [own, of_target] = folders.each_ref().map(|folder| folder.join(location));
    match own.canonicalize() {
        Err(why) if why.kind() == ErrorKind::NotFound => of_target.canonicalize(),
        found => found,
    }
}

/// Where the numbers of a tensor are.
#[derive(Default)]
struct ExternalPlace {
    location: Option<String>,
    offset: u64,
    length: Option<u64>,
}

impl ExternalPlace {
    /// Takes one of the pairs of texts.
    fn set(&mut self, pair: &[u8]) -> Result<(), ExternalError> {
        let (mut key, mut value) = ("", "");
        for field in fields(pair) {
            let field = field?;
            let WireValue::Bytes(text) = field.value else {
                continue;
            };
            let text = std::str::from_utf8(text).map_err(|_| ExternalError::Damaged)?;
            match field.number {
                1 => key = text,
                2 => value = text,
                _ => {}
            }
        }
        let number = || value.parse().map_err(|_| ExternalError::Damaged);
        match key {
            "location" => self.location = Some(value.to_owned()),
            "offset" => self.offset = number()?,
            "length" => self.length = Some(number()?),
            _ => {}
        }
        Ok(())
    }
}
