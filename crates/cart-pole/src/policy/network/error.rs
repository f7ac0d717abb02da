//! The errors in a file of weights, as text: the expected and the actual content. Texts from the
//! file are quoted, so that each error stays one line.

/// A tensor is missing; the file has something else of its name, or other tensors.
pub(super) fn missing(name: &str, found: &str) -> String {
    format!("expected a tensor {name:?}, found {found}")
}

/// A tensor is missing among those called `names`.
pub(super) fn missing_among<'n>(
    name: &str,
    names: impl ExactSizeIterator<Item = &'n str>,
) -> String {
    /// Maximum number of names in a message.
    const TOLD: usize = 6;
    let count = names.len();
    let mut told: Vec<String> = names.take(TOLD).map(quoted).collect();
    if count > TOLD {
        told.push(format!("{} more", count - TOLD));
    }
    match count {
        0 => missing(name, "no tensors"),
        _ => missing(name, &told.join(", ")),
    }
}

/// A tensor has another shape.
pub(super) fn shape(name: &str, expected: &str, found: &[usize]) -> String {
    format!("expected {name:?} of shape {expected}, found {found:?}")
}

/// A tensor has elements of another type.
pub(super) fn kind(name: &str, found: &str) -> String {
    format!("expected {name:?} of float16, float32 or float64, found {found}")
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
