//! Policies as ONNX graphs, run by the ONNX Runtime where it is installed.
//!
//! The graph takes `float32[1, 5]`, an observation, and returns `float32[1, 1]`, an
//! action. Unlike the other formats, ONNX files are parsed by the runtime's own code: its
//! use of memory and time is unbounded here, and each decision allocates.

#[cfg(not(feature = "onnx"))]
mod absent;
#[cfg(feature = "onnx")]
mod runtime;

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
