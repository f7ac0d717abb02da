//! Why a pickle is not read.

use std::fmt::Display;

use super::super::{
    error::{WeightsError, unfit},
    library::Library,
};

/// The result of one step through a pickle.
pub(super) type PickleResult<T = ()> = Result<T, PickleError>;

/// Why a pickle is not read.
pub(super) enum PickleError {
    /// It is not valid, for this reason.
    Invalid(String),
    /// It makes something else than a dictionary.
    NoDictionary(&'static str),
    /// It asks for code.
    Code {
        /// What it asks for.
        what: String,
        /// Whether the whole pickle is an object of that class.
        is_whole: bool,
        /// The library that wrote it, as far as it was read.
        library: Option<Library>,
    },
}

/// Returns an error for an invalid pickle, with the reason.
pub(super) fn nonsense<T>(why: impl Display) -> PickleResult<T> {
    Err(PickleError::Invalid(why.to_string()))
}

impl From<PickleError> for WeightsError {
    fn from(error: PickleError) -> Self {
        let never = "only tensors are read from a checkpoint, never code";
        match error {
            PickleError::Invalid(why) => Self::Damaged(format!(
                "expected a PyTorch checkpoint, found an invalid pickle: {why}"
            )),
            PickleError::NoDictionary(found) => {
                unfit(format!("expected a dictionary of tensors, found {found}"))
            }
            PickleError::Code {
                what,
                is_whole: true,
                ..
            } => unfit(format!(
                "{never}; this one is a whole object of {what}: save its state_dict alone"
            )),
            PickleError::Code {
                what,
                library: Some(library),
                ..
            } => Self::Unfit {
                why: format!("{never}; this one asks for {what}, and is {}", library.what),
                program: Some(library.program),
            },
            PickleError::Code { what, .. } => unfit(format!(
                "{never}; this one asks for {what}: save the state_dict alone"
            )),
        }
    }
}
