//! Policies as ONNX graphs, run by the ONNX Runtime where it is installed.
//!
//! The graph takes an observation of float32 and returns an action. What else it takes are outputs of
//! its last answer: the memory of a recurrent network. Unlike the other formats, ONNX files are parsed by the runtime's own code: its
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
pub(crate) use absent::OnnxModel;
pub(crate) use external::WholeGraph;
#[cfg(feature = "onnx")]
pub(crate) use runtime::OnnxModel;
