//! The errors in a file of weights: the expected and the actual content. Texts from the file are
//! quoted, so that each error stays one line.

use crate::{WeightsError, format::ProgramKind};

/// Returns a network of PyTorch that is not computed here.
pub(super) fn unfit(why: String) -> WeightsError {
    WeightsError::Unfit {
        why,
        program: Some(ProgramKind::Module),
    }
}

/// Returns the error for a tensor of another shape.
pub(super) fn shape(name: &str, expected: &str, found: &[usize]) -> WeightsError {
    unfit(format!(
        "expected {name:?} of shape {expected}, found {found:?}"
    ))
}

/// Returns the error for a tensor of another type.
pub(super) fn kind(name: &str, found: &str) -> WeightsError {
    unfit(format!(
        "expected {name:?} of float16, bfloat16, float32 or float64, found {found}"
    ))
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

/// Quotes the first of these names.
pub(super) fn listed<'n>(names: impl ExactSizeIterator<Item = &'n str>) -> String {
    /// Maximum number of names in a message.
    const TOLD: usize = 6;
    let count = names.len();
    let mut told: Vec<String> = names.take(TOLD).map(quoted).collect();
    if count > TOLD {
        told.push(format!("{} more", count - TOLD));
    }
    told.join(", ")
}
