//! Policies as ONNX graphs, run by the ONNX Runtime where that is installed.
//!
//! The graph takes `float32[1, 5]`, an observation, and gives `float32[1, 1]`, an
//! action. Unlike the files that are read here to the last byte, an ONNX file is
//! in the hands of the runtime's own code: what it takes in memory and time is
//! that runtime's business, and each decision allocates.

#[cfg(not(feature = "onnx"))]
mod absent;
#[cfg(feature = "onnx")]
mod runtime;

use thiserror::Error;

/// Whether this was built to run ONNX files.
pub const RUNS_ONNX: bool = cfg!(feature = "onnx");

#[cfg(not(feature = "onnx"))]
pub(super) use absent::Model;
#[cfg(feature = "onnx")]
pub(super) use runtime::Model;

/// The field that an ONNX file begins with, the version of its format.
const VERSION_FIELD: u8 = 0x08;

/// Whether `content` begins as an ONNX file does, and not as safetensors of a
/// short header.
pub(super) fn is_onnx(content: &[u8]) -> bool {
    content.first() == Some(&VERSION_FIELD) && content.get(8) != Some(&b'{')
}

/// An ONNX file that cannot be run.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum OnnxError {
    /// The library is not there.
    #[error(
        "it takes the ONNX Runtime, which was not found ({0}): the Python wheel carries it \
         (python3 -m pip install onnxruntime); set ORT_DYLIB_PATH to its libonnxruntime, in the \
         folder onnxruntime/capi"
    )]
    NoRuntime(String),
    /// This program was built without.
    #[error("it takes the ONNX Runtime, without which this was built: build with --features onnx")]
    NotBuilt,
    /// The runtime does not take the file.
    #[error("expected an ONNX graph, found one that the ONNX Runtime refuses: {0}")]
    Refused(String),
    /// The graph is not that of a policy for this robot.
    #[error("expected a graph from float32[1, 5] to float32[1, 1], found {0}")]
    Signature(String),
}
