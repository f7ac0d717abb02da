//! Formats of files, and the way out of one that is not read.

use strum::{Display, EnumString, VariantNames};

/// The format of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FileFormat {
    /// A text with a first line `#!`.
    Script,
    /// A program of the machine.
    Binary,
    /// A zip, as PyTorch writes checkpoints.
    Zip,
    /// A Python pickle, without a zip around it.
    Pickle,
    /// Tensors in safetensors.
    Safetensors,
    /// An ONNX graph.
    Onnx,
    /// What Git LFS leaves in the place of a file.
    LfsPointer,
    /// Another format of this name.
    Other(&'static str),
    /// Nothing known.
    Unknown,
}

/// The first bytes of formats.
const BEGINNINGS: [(&[u8], FileFormat); 15] = [
    (b"#!", FileFormat::Script),
    (b"\x7fELF", FileFormat::Binary),
    (b"\xcf\xfa\xed\xfe", FileFormat::Binary),
    (b"\xca\xfe\xba\xbe", FileFormat::Binary),
    (b"PK\x03\x04", FileFormat::Zip),
    (b"\x80", FileFormat::Pickle),
    (
        b"version https://git-lfs.github.com/",
        FileFormat::LfsPointer,
    ),
    (
        b"\x89HDF\r\n\x1a\n",
        FileFormat::Other("HDF5, as Keras writes it"),
    ),
    (b"\x93NUMPY", FileFormat::Other("an array of NumPy (.npy)")),
    (b"GGUF", FileFormat::Other("GGUF")),
    (b"RRF2", FileFormat::Other("a recording")),
    (b"\x1f\x8b", FileFormat::Other("a gzip archive")),
    (b"BZh", FileFormat::Other("a bzip2 archive")),
    (b"{", FileFormat::Other("a text in JSON")),
    (b"[", FileFormat::Other("a text in JSON")),
];

/// Names of formats whose sign is not at the beginning.
const INSIDE: [(usize, &[u8], &str); 2] = [
    (4, b"TFL3", "a TensorFlow Lite model"),
    (257, b"ustar", "a tar archive"),
];

/// The first field of an ONNX file, the version of its format.
const ONNX_VERSION: u8 = 0x08;

impl FileFormat {
    /// Detects the format of a file with this `content`.
    pub(crate) fn detect(content: &[u8]) -> Self {
        let at = |place: usize| content.get(place..).unwrap_or_default();
        let inside = INSIDE
            .iter()
            .find(|(place, sign, _)| at(*place).starts_with(sign));
        if let Some((.., name)) = inside {
            return Self::Other(name);
        }
        // The length of a header comes first, in 8 bytes.
        if at(5).starts_with(b"\0\0\0{") {
            return Self::Safetensors;
        }
        if content.first() == Some(&ONNX_VERSION) {
            return Self::Onnx;
        }
        BEGINNINGS
            .iter()
            .find(|(beginning, _)| content.starts_with(beginning))
            .map_or(Self::Unknown, |(_, format)| *format)
    }
}

/// A program that `ratelab new --policy` writes: what it loads the policy with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Display, EnumString, VariantNames)]
#[strum(serialize_all = "lowercase")]
pub enum ProgramKind {
    /// A model of Stable-Baselines3.
    Sb3,
    /// A TorchScript file, or an exported program.
    TorchScript,
    /// An ONNX file.
    Onnx,
    /// A module of PyTorch and its state dictionary.
    Module,
}

impl ProgramKind {
    /// The names of all kinds, in texts.
    pub const NAMES: &[&str] = <Self as VariantNames>::VARIANTS;
}

/// Returns what to do with a policy that a program of this kind can run, or one written from
/// nothing: the end of a sentence.
pub fn way_out(kind: Option<ProgramKind>) -> String {
    match kind {
        Some(kind) => format!(
            "a short program can run it: ratelab new policy.py --policy {kind} (docs/policies.md)"
        ),
        None => "a program of your own can run it (docs/policies.md)".to_owned(),
    }
}
