//! Errors of a file of weights.

use thiserror::Error;

/// A file that holds no actor for this robot. Texts from the file are quoted, so
/// that the message stays one line whatever they are.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum WeightsError {
    /// It is no kind of file that is read.
    #[error("expected a PyTorch checkpoint (.pt), safetensors or ONNX, found none of them: {0}")]
    Format(String),
    /// A checkpoint of the time before PyTorch wrote zips.
    #[error(
        "expected a PyTorch checkpoint that is a zip, found a bare pickle, as PyTorch wrote before \
         1.6: load it there and save it again"
    )]
    Legacy,
    /// A zip, but no checkpoint, or a damaged one.
    #[error("expected a PyTorch checkpoint, found a zip that is none: {0}")]
    Zip(String),
    /// The pickle asks for more than tensors.
    #[error(
        "only tensors are read from a checkpoint, never code; this one asks for {0}: \
         save the state_dict alone"
    )]
    Forbidden(String),
    /// The pickle makes no sense.
    #[error("expected a PyTorch checkpoint, found a pickle that makes no sense: {0}")]
    Pickle(String),
    /// A tensor is not there.
    #[error("expected a tensor {name:?}, found {found}")]
    Missing {
        /// Its name.
        name: &'static str,
        /// What there is.
        found: String,
    },
    /// A tensor has another shape.
    #[error("expected {name:?} of shape {expected}, found {found:?}")]
    Shape {
        /// Its name.
        name: &'static str,
        /// The shape that it must have.
        expected: String,
        /// The shape that it has.
        found: Vec<usize>,
    },
    /// A tensor of numbers that are not read.
    #[error("expected {name:?} of float16, float32 or float64, found {found}")]
    Kind {
        /// Its name.
        name: &'static str,
        /// The kind of its numbers.
        found: String,
    },
    /// A tensor whose numbers are not all there.
    #[error("expected all numbers of {name:?}, found {found}")]
    Short {
        /// Its name.
        name: &'static str,
        /// What there is.
        found: String,
    },
    /// A weight that is no number to compute with.
    #[error("expected finite numbers, found {value} in {name:?} at {index}")]
    NotFinite {
        /// The tensor.
        name: &'static str,
        /// Where in it, row by row.
        index: usize,
        /// What it is.
        value: f32,
    },
}

impl WeightsError {
    /// A tensor is missing among `names`.
    pub(super) fn missing<'n>(
        name: &'static str,
        names: impl ExactSizeIterator<Item = &'n str>,
    ) -> Self {
        /// How many names are told.
        const TOLD: usize = 6;
        let count = names.len();
        let mut told: Vec<String> = names.take(TOLD).map(quoted).collect();
        if count > TOLD {
            told.push(format!("{} more", count - TOLD));
        }
        let found = match count {
            0 => "no tensors".to_owned(),
            _ => told.join(", "),
        };
        Self::Missing { name, found }
    }
}

/// A text from a file, safe to print and not too long.
pub(super) fn quoted(text: &str) -> String {
    /// Longest text that is told whole (characters).
    const WHOLE: usize = 80;
    if text.chars().count() <= WHOLE {
        return format!("{text:?}");
    }
    let start: String = text.chars().take(WHOLE).collect();
    format!("{start:?}…")
}
