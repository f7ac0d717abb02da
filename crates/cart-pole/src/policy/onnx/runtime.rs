//! The ONNX Runtime, loaded when the first graph needs it.

use std::{
    env::{self, consts},
    fmt,
    sync::{Arc, Mutex, OnceLock},
};

use ort::{
    environment::Environment,
    logging::LogLevel,
    session::Session,
    value::{Outlet, TensorElementType, TensorRef, ValueType},
};
use ratelab::sync::lock;

use crate::{
    Action, Observation,
    policy::{
        Policy, PolicyFault,
        format::{ProgramKind, way_out},
    },
};

/// Environment variable with the path of the library, if it is outside of the system's
/// search path.
const LIBRARY: &str = "ORT_DYLIB_PATH";

/// A graph that is ready to run; clones share it.
#[derive(Clone)]
pub(in crate::policy) struct OnnxModel(Arc<Mutex<Session>>);

impl fmt::Debug for OnnxModel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Model")
    }
}

impl OnnxModel {
    /// Loads the graph in `content`.
    pub(in crate::policy) fn open(content: &[u8]) -> Result<Self, PolicyFault> {
        let session = session(environment()?, content).map_err(|why| {
            let why = one_line(&why);
            let way_out = way_out(Some(ProgramKind::Onnx));
            PolicyFault::Other(format!(
                "expected an ONNX graph, found one that the ONNX Runtime refuses: {why}; {way_out}"
            ))
        })?;
        let (inputs, outputs) = (session.inputs(), session.outputs());
        if !(takes(inputs, 5) && takes(outputs, 1)) {
            return Err(PolicyFault::Other(format!(
                "expected a graph from float32[1, 5] to float32[1, 1], found {} to {}; {}",
                types(inputs),
                types(outputs),
                way_out(Some(ProgramKind::Onnx))
            )));
        }
        Ok(Self(Arc::new(Mutex::new(session))))
    }

    /// Creates a policy called `name` that runs the graph.
    pub(in crate::policy) fn policy(&self, name: &str) -> Box<dyn Policy> {
        Box::new(Onnx {
            name: name.to_owned(),
            model: self.clone(),
        })
    }

    fn answer(&self, seen: &[f32; 5]) -> ort::Result<f32> {
        let mut session = lock(&self.0);
        let input = TensorRef::from_array_view(([1_usize, 5], &seen[..]))?;
        let outputs = session.run(ort::inputs![input])?;
        outputs[0].try_extract_scalar()
    }
}

/// Loads the runtime on first use.
fn environment() -> Result<&'static Environment, PolicyFault> {
    static LOADED: OnceLock<Environment> = OnceLock::new();
    if let Some(loaded) = LOADED.get() {
        return Ok(loaded);
    }
    let usual = || format!("{}onnxruntime{}", consts::DLL_PREFIX, consts::DLL_SUFFIX).into();
    let path = env::var_os(LIBRARY).filter(|path| !path.is_empty());
    let loaded = ort::init_from(path.unwrap_or_else(usual)).map_err(no_runtime)?;
    let built = loaded.with_telemetry(false).build().map_err(no_runtime)?;
    // By default it logs to the terminal, which belongs to the dashboard.
    built.set_log_level(LogLevel::Fatal);
    Ok(LOADED.get_or_init(|| built))
}

fn no_runtime(why: impl fmt::Display) -> PolicyFault {
    PolicyFault::Other(format!(
        "it takes the ONNX Runtime, which was not found ({}): the Python wheel carries it (python3 \
         -m pip install onnxruntime); set ORT_DYLIB_PATH to its libonnxruntime, in the folder \
         onnxruntime/capi",
        one_line(&why)
    ))
}

/// Uses one thread, so that sums are always added in the same order.
fn session(environment: &Environment, content: &[u8]) -> ort::Result<Session> {
    Session::builder(environment)?
        .with_intra_threads(1)?
        .commit_from_memory(content)
}

/// Returns whether there is exactly one matrix, with one row or a variable number, and `columns`
/// columns.
fn takes(outlets: &[Outlet], columns: i64) -> bool {
    let [outlet] = outlets else { return false };
    match outlet.dtype() {
        ValueType::Tensor { ty, shape, .. } => {
            *ty == TensorElementType::Float32
                && matches!(shape[..], [1 | -1, last] if last == columns)
        }
        _ => false,
    }
}

fn types(outlets: &[Outlet]) -> String {
    let types: Vec<String> = outlets.iter().map(|o| o.dtype().to_string()).collect();
    types.join(", ").escape_debug().to_string()
}

fn one_line(why: &dyn fmt::Display) -> String {
    let words = why.to_string();
    let words: Vec<&str> = words.split_whitespace().collect();
    words.join(" ")
}

struct Onnx {
    name: String,
    model: OnnxModel,
}

impl Policy for Onnx {
    fn name(&self) -> &str {
        &self.name
    }

    /// Returns NaN if the runtime fails, which ends the run with a fault.
    fn act(&mut self, observation: &Observation) -> Action {
        let answer = self.model.answer(&observation.to_array());
        Action(answer.unwrap_or(f32::NAN))
    }
}
