//! The archive of a checkpoint, read within bounds, and its errors.

use std::fmt::Display;

use crate::{
    WeightsError,
    format::ProgramKind,
    network::{
        error::{listed, unfit},
        state::Library,
    },
};

/// Returns the error for a zip with these `names` that is known to be something else.
pub(super) fn other_archive(names: &[&str]) -> Option<WeightsError> {
    let among = |wanted: &str| names.contains(&wanted);
    let ends = |end: &str| names.iter().any(|name| name.ends_with(end));
    let (what, program) = if among("policy.pth") || among("_stable_baselines3_version") {
        let found = ["policy.pth", "_stable_baselines3_version"]
            .into_iter()
            .filter(|name| among(name));
        let found: Vec<&str> = found.collect();
        let what = format!(
            "a Stable-Baselines3 model ({} in the zip)",
            found.join(" and ")
        );
        (what, Some(ProgramKind::Sb3))
    } else if ends("/constants.pkl") {
        let what = "TorchScript, which is code (constants.pkl in the zip)";
        (what.to_owned(), Some(ProgramKind::TorchScript))
    } else if ends("/archive_format") || ends("serialized_exported_program.json") {
        let what = "a program exported by torch.export (.pt2)";
        (what.to_owned(), Some(ProgramKind::TorchScript))
    } else if ends(".weights.h5") {
        (
            "a model of Keras (model.weights.h5 in the zip)".to_owned(),
            None,
        )
    } else if !names.is_empty() && names.iter().all(|name| name.ends_with(".npy")) {
        let what = format!("arrays of NumPy (.npz): {}", listed(names.iter().copied()));
        (what, None)
    } else {
        return None;
    };
    Some(WeightsError::Unfit {
        why: format!("expected a PyTorch checkpoint with a state_dict alone, found {what}"),
        program,
    })
}

/// The unread bytes.
#[derive(Default)]
pub(super) struct Bytes<'a>(pub(super) &'a [u8]);

impl<'a> Bytes<'a> {
    /// Returns the next `count` bytes.
    pub(super) fn take(&mut self, count: usize) -> PickleResult<&'a [u8]> {
        match self.0.split_at_checked(count) {
            Some((taken, rest)) => {
                self.0 = rest;
                Ok(taken)
            }
            None => nonsense("it ends in the middle"),
        }
    }

    /// Returns the next byte.
    pub(super) fn byte(&mut self) -> PickleResult<u8> {
        self.array().map(|[byte]| byte)
    }

    /// Returns the next `N` bytes.
    pub(super) fn array<const N: usize>(&mut self) -> PickleResult<[u8; N]> {
        let taken = self.take(N)?;
        taken
            .try_into()
            .or_else(|_| nonsense("it ends in the middle"))
    }

    /// Returns the text up to the end of the line.
    pub(super) fn line(&mut self) -> PickleResult<&'a str> {
        let end = self.0.iter().position(|byte| *byte == b'\n');
        let line = self.take(end.map_or(usize::MAX, |end| end + 1))?;
        utf8(&line[..line.len() - 1])
    }
}

/// These bytes as a text.
pub(super) fn utf8(bytes: &[u8]) -> PickleResult<&str> {
    std::str::from_utf8(bytes).or_else(|_| nonsense("a string that is not UTF-8"))
}

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
