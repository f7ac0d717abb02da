//! Names in a sentence.

use std::borrow::Borrow;

/// Returns names as alternatives: `a, b or c`.
pub fn alternatives<S: Borrow<str>>(names: &[S]) -> String {
    match names {
        [others @ .., last] if !others.is_empty() => {
            format!("{} or {}", others.join(", "), last.borrow())
        }
        names => names.concat(),
    }
}
