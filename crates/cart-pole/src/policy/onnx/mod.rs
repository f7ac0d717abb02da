//! Policies as ONNX graphs, run by the ONNX Runtime where it is installed.
//!
//! The graph takes `float32[1, 5]`, an observation, and returns `float32[1, 1]`, an
//! action. Unlike the other formats, ONNX files are parsed by the runtime's own code: its
//! use of memory and time is unbounded here, and each decision allocates.

#[cfg(not(feature = "onnx"))]
mod absent;
#[cfg(feature = "onnx")]
mod runtime;

use thiserror::Error;

/// Whether this build supports ONNX files.
pub const RUNS_ONNX: bool = cfg!(feature = "onnx");

#[cfg(not(feature = "onnx"))]
pub(super) use absent::OnnxModel;
#[cfg(feature = "onnx")]
pub(super) use runtime::OnnxModel;

/// The first field of an ONNX file, the version of its format.
const VERSION_FIELD: u8 = 0x08;

/// Whether `content` begins like an ONNX file, rather than like safetensors with a short
/// header.
pub(super) fn is_onnx(content: &[u8]) -> bool {
    content.first() == Some(&VERSION_FIELD) && content.get(8) != Some(&b'{')
}

/// An error with an ONNX file.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum OnnxError {
    /// The library was not found.
    #[error(
        "it takes the ONNX Runtime, which was not found ({0}): the Python wheel carries it \
         (python3 -m pip install onnxruntime); set ORT_DYLIB_PATH to its libonnxruntime, in the \
         folder onnxruntime/capi"
    )]
    NoRuntime(String),
    /// This program was built without ONNX support.
    #[error("it takes the ONNX Runtime, without which this was built: build with --features onnx")]
    NotBuilt,
    /// The runtime refused the file.
    #[error("expected an ONNX graph, found one that the ONNX Runtime refuses: {0}")]
    Refused(String),
    /// The graph has the wrong inputs or outputs for this robot.
    #[error("expected a graph from float32[1, 5] to float32[1, 1], found {0}")]
    Signature(String),
}
