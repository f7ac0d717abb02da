//! The ONNX Runtime, loaded when the first graph needs it.

use std::{
    env::{self, consts},
    fmt,
    sync::{Arc, Mutex, OnceLock},
};

use ort::{
    environment::Environment,
    logging::LogLevel,
    session::{Session, SessionInputValue},
    value::{Outlet, TensorElementType, TensorRef, ValueType},
};
use ratelab::sync::lock;

use crate::{
    AnswerKind, PolicyFault, RowPolicy,
    format::{ProgramKind, way_out},
};

/// Environment variable with the path of the library, if it is outside of the system's
/// search path.
const LIBRARY: &str = "ORT_DYLIB_PATH";

/// Names of the output with the action, the most telling one first.
const ACTIONS: [&str; 3] = ["actions", "action", "mean"];

/// A graph that is ready to run; clones share it.
#[derive(Clone)]
pub(crate) struct OnnxModel {
    session: Arc<Mutex<Session>>,
    /// The numbers that the observation's dimensions have: `None` for as many as there are.
    sees: Arc<[Option<usize>]>,
    /// The inputs that are outputs of the last answer, at first zeros.
    states: Arc<[GraphState]>,
    /// Index of the output with the action.
    action: usize,
}

/// An input of a recurrent graph.
#[derive(Clone, Debug)]
struct GraphState {
    shape: Vec<usize>,
    /// Index of the output that becomes this input.
    output: usize,
}

impl fmt::Debug for OnnxModel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Model")
    }
}

impl OnnxModel {
    /// Loads the graph in `content`.
    pub(crate) fn open(content: &[u8]) -> Result<Self, PolicyFault> {
        let session = session(environment()?, content).map_err(|why| {
            let why = one_line(&why);
            let way_out = way_out(Some(ProgramKind::Onnx));
            PolicyFault::Other(format!(
                "expected an ONNX graph, found one that the ONNX Runtime refuses: {why}; {way_out}"
            ))
        })?;
        let (inputs, outputs) = (session.inputs(), session.outputs());
        let read = || {
            let (seen, states) = inputs.split_first()?;
            let named = |name| outputs.iter().position(|output| output.name() == name);
            let action = ACTIONS.into_iter().find_map(named).unwrap_or(0);
            let mut free: Vec<usize> = (0..outputs.len()).filter(|at| *at != action).collect();
            let states = states.iter().map(|input| {
                let shape = dimensions(input)?;
                let output = free
                    .iter()
                    .position(|output| dimensions(&outputs[*output]).as_ref() == Some(&shape))?;
                Some(GraphState {
                    shape: shape.iter().map(|size| size.unwrap_or(1)).collect(),
                    output: free.remove(output),
                })
            });
            let states: Vec<GraphState> = states.collect::<Option<_>>()?;
            dimensions(outputs.get(action)?)?;
            Some((dimensions(seen)?, states, action))
        };
        let (sees, states, action) = read().ok_or_else(|| {
            PolicyFault::Other(format!(
                "expected a graph from an observation of float32 to an action, found {}; {}",
                types(&session),
                way_out(Some(ProgramKind::Onnx))
            ))
        })?;
        Ok(Self {
            sees: sees.into(),
            states: states.into(),
            action,
            session: Arc::new(Mutex::new(session)),
        })
    }

    /// Returns the numbers of an observation, if the graph says it.
    pub(crate) fn inputs(&self) -> Option<usize> {
        *self.sees.last()?
    }

    /// Returns the numbers of an answer to so many numbers.
    ///
    /// # Errors
    /// What was expected and what was found, if it does not take them.
    pub(crate) fn outputs(&self, sees: usize) -> Result<usize, PolicyFault> {
        let found = || types(&lock(&self.session));
        let way_out = way_out(Some(ProgramKind::Onnx));
        let mut graph = self.asked(0);
        graph.seen.resize(sees, 0.0);
        let fits = self.shape(sees).is_some();
        fits.then(|| graph.run())
            .and_then(Result::ok)
            .map(|()| graph.answer.len())
            .ok_or_else(|| {
                PolicyFault::Other(format!(
                    "expected a graph from float32[1, {sees}], found {}; {way_out}",
                    found()
                ))
            })
    }

    /// Creates a policy that runs the graph, whose answers have so many numbers, for actions of `width`.
    pub(crate) fn policy(&self, answers: usize, width: usize) -> Box<dyn RowPolicy> {
        let mut policy = self.asked(answers);
        policy.width = width;
        Box::new(policy)
    }

    fn asked(&self, answers: usize) -> OnnxPolicy {
        let zeros = |state: &GraphState| vec![0.0; state.shape.iter().product()];
        OnnxPolicy {
            states: self.states.iter().map(zeros).collect(),
            model: self.clone(),
            seen: Vec::new(),
            answer: vec![0.0; answers],
            width: 1,
        }
    }

    /// Returns the dimensions of an observation of so many numbers; `None` if they do not fit.
    fn shape(&self, sees: usize) -> Option<Vec<usize>> {
        let (last, before) = self.sees.split_last()?;
        let fits = last.is_none_or(|last| last == sees)
            && before.iter().all(|size| size.is_none_or(|size| size == 1));
        let ones = before.iter().map(|_| 1);
        fits.then(|| ones.chain([sees]).collect())
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

/// Returns the dimensions of numbers in single precision: `None` for a size that is up to the
/// caller.
fn dimensions(outlet: &Outlet) -> Option<Vec<Option<usize>>> {
    let ValueType::Tensor {
        ty: TensorElementType::Float32,
        shape,
        ..
    } = outlet.dtype()
    else {
        return None;
    };
    Some(
        shape
            .iter()
            .map(|size| usize::try_from(*size).ok())
            .collect(),
    )
}

/// Returns the types of all inputs and outputs.
fn types(session: &Session) -> String {
    let list = |outlets: &[Outlet]| {
        let types: Vec<String> = outlets.iter().map(|o| o.dtype().to_string()).collect();
        types.join(", ").escape_debug().to_string()
    };
    format!("{} to {}", list(session.inputs()), list(session.outputs()))
}

fn one_line(why: &dyn fmt::Display) -> String {
    let words = why.to_string();
    let words: Vec<&str> = words.split_whitespace().collect();
    words.join(" ")
}

/// A graph that is asked, with what it remembers.
pub(crate) struct OnnxPolicy {
    model: OnnxModel,
    seen: Vec<f32>,
    states: Vec<Vec<f32>>,
    answer: Vec<f64>,
    /// Numbers of an action.
    width: usize,
}

impl OnnxPolicy {
    /// Runs the graph for what is seen.
    fn run(&mut self) -> ort::Result<()> {
        let model = &self.model;
        let mut session = lock(&model.session);
        let shape = model.shape(self.seen.len()).unwrap_or_default();
        let mut inputs: Vec<SessionInputValue<'_>> =
            vec![TensorRef::from_array_view((shape, &self.seen[..]))?.into()];
        for (state, values) in model.states.iter().zip(&self.states) {
            let view = TensorRef::from_array_view((state.shape.clone(), &values[..]))?;
            inputs.push(view.into());
        }
        let outputs = session.run(&inputs[..])?;
        let mut next = Vec::with_capacity(model.states.len());
        for state in &*model.states {
            let (_, values) = outputs[state.output].try_extract_tensor::<f32>()?;
            next.push(values.to_vec());
        }
        let (_, answer) = outputs[model.action].try_extract_tensor::<f32>()?;
        self.answer.clear();
        self.answer.extend(answer.iter().copied().map(f64::from));
        drop(outputs);
        drop(inputs);
        self.states = next;
        Ok(())
    }
}

impl RowPolicy for OnnxPolicy {
    /// Returns NaN if the runtime fails, which ends the run with a fault.
    fn answer(&mut self, observation: &[f64]) -> &[f64] {
        self.seen.clear();
        self.seen
            .extend(observation.iter().map(|number| *number as f32));
        if self.run().is_err() {
            self.answer = vec![f64::NAN];
        }
        &self.answer
    }

    fn kind(&self) -> AnswerKind {
        AnswerKind::from_size(self.answer.len(), self.width)
    }
}
