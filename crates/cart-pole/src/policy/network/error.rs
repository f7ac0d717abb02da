//! Errors in a file of weights.

use thiserror::Error;

/// An invalid file of weights for this robot. Texts from the file are quoted, so that the
/// message always stays one line.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum WeightsError {
    /// An unknown file format.
    #[error("expected a PyTorch checkpoint (.pt), safetensors or ONNX, found none of them: {0}")]
    Format(String),
    /// A checkpoint in the format before PyTorch used zips.
    #[error(
        "expected a PyTorch checkpoint that is a zip, found a bare pickle, as PyTorch wrote before \
         1.6: load it there and save it again"
    )]
    Legacy,
    /// A zip that is no checkpoint, or is damaged.
    #[error("expected a PyTorch checkpoint, found a zip that is none: {0}")]
    Zip(String),
    /// The pickle names something other than tensors.
    #[error(
        "only tensors are read from a checkpoint, never code; this one asks for {0}: \
         save the state_dict alone"
    )]
    Forbidden(String),
    /// The pickle is invalid.
    #[error("expected a PyTorch checkpoint, found an invalid pickle: {0}")]
    Pickle(String),
    /// A missing tensor.
    #[error("expected a tensor {name:?}, found {found}")]
    Missing {
        /// Name of the tensor.
        name: &'static str,
        /// The tensors in the file.
        found: String,
    },
    /// A tensor of the wrong shape.
    #[error("expected {name:?} of shape {expected}, found {found:?}")]
    Shape {
        /// Name of the tensor.
        name: &'static str,
        /// The expected shape.
        expected: String,
        /// The shape found.
        found: Vec<usize>,
    },
    /// A tensor with an unsupported element type.
    #[error("expected {name:?} of float16, float32 or float64, found {found}")]
    Kind {
        /// Name of the tensor.
        name: &'static str,
        /// The type found.
        found: String,
    },
    /// A truncated tensor.
    #[error("expected all numbers of {name:?}, found {found}")]
    Short {
        /// Name of the tensor.
        name: &'static str,
        /// The size found.
        found: String,
    },
    /// A weight that is NaN or infinite.
    #[error("expected finite numbers, found {value} in {name:?} at {index}")]
    NotFinite {
        /// Name of the tensor.
        name: &'static str,
        /// Index of the weight, row by row.
        index: usize,
        /// Its value.
        value: f32,
    },
}

impl WeightsError {
    /// An error for a tensor missing among `names`.
    pub(super) fn missing<'n>(
        name: &'static str,
        names: impl ExactSizeIterator<Item = &'n str>,
    ) -> Self {
        /// Maximum number of names in a message.
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

/// Quotes a text from a file, safe to print and shortened if necessary.
pub(super) fn quoted(text: &str) -> String {
    /// Longest text that is printed in full (characters).
    const WHOLE: usize = 80;
    if text.chars().count() <= WHOLE {
        return format!("{text:?}");
    }
    let start: String = text.chars().take(WHOLE).collect();
    format!("{start:?}…")
}
