//! Policies as ONNX graphs, run by the ONNX Runtime where it is installed.
//!
//! The graph takes `float32[1, 5]`, an observation, and returns `float32[1, 1]`, an
//! action. Unlike the other formats, ONNX files are parsed by the runtime's own code: its
//! use of memory and time is unbounded here, and each decision allocates.
//!
//! Weights in files of their own are read here and put into the graph (`external.rs`), so that
//! what is pinned is what runs, and the runtime opens no file.

#[cfg(not(feature = "onnx"))]
mod absent;
mod external;
#[cfg(feature = "onnx")]
mod runtime;
mod wire;

/// Whether this build supports ONNX files.
pub const RUNS_ONNX: bool = cfg!(feature = "onnx");

#[cfg(not(feature = "onnx"))]
pub(super) use absent::OnnxModel;
pub(super) use external::WholeGraph;
#[cfg(feature = "onnx")]
pub(super) use runtime::OnnxModel;
