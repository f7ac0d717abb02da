//! The mark of a prediction in a file: whether ratelab wrote it as it stands.
//!
//! It is not a seal: whoever reads this file can make one. It shows that a file was changed in
//! an editor, or copied from another file.

use ratelab::Digest;
use std::hash::{BuildHasher, Hasher, RandomState};

/// How a prediction came into its file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PredictionOrigin {
    /// ratelab wrote it. No other prediction has the same mark, unless it is a copy.
    Written(String),
    /// It has no mark: an earlier version wrote it, or somebody else.
    Unmarked,
    /// It was changed after ratelab wrote it.
    Edited,
}

/// Digits of the part that is drawn, and of the check of the rest.
const DIGITS: usize = 16;

/// Returns a mark for `content` that no other one repeats.
pub(super) fn new(content: &str) -> String {
    // Each of these has keys of its own, drawn by the operating system.
    let drawn = format!("{:0DIGITS$x}", RandomState::new().build_hasher().finish());
    let check = check(&drawn, content);
    format!("{drawn}-{check}")
}

/// Returns how `content` with this `mark` came into its file.
pub(super) fn origin(mark: Option<&str>, content: &str) -> PredictionOrigin {
    let Some(mark) = mark else {
        return PredictionOrigin::Unmarked;
    };
    match mark.split_once('-') {
        Some((drawn, found)) if found == check(drawn, content) => {
            PredictionOrigin::Written(mark.to_owned())
        }
        _ => PredictionOrigin::Edited,
    }
}

fn check(drawn: &str, content: &str) -> String {
    let digest = Digest::new(format!("{drawn} {content}").as_bytes());
    digest.to_string().chars().take(DIGITS).collect()
}
