//! Texts that are not valid settings, and the names that are, in a sentence.

use std::borrow::Borrow;

use thiserror::Error;

use super::digest::{Digest, DigestError};
use crate::{millis::MillisError, qos::DepthError};

/// The largest offset of a clock (ms): eleven and a half days.
pub(super) const MAX_OFFSET_MS: f64 = 1e9;

/// The largest drift of a clock (ppm): half or one and a half times the speed.
pub(super) const MAX_DRIFT_PPM: f64 = 500_000.0;

/// The factors of a draw: least and greatest.
pub(super) const FACTORS: (f64, f64) = (1e-6, 1e6);

/// A text that is not a valid setting: what is wrong with it, and what is expected.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum SettingError {
    /// Not a number of milliseconds.
    #[error(transparent)]
    Millis(#[from] MillisError),
    /// Not a SHA-256.
    #[error(transparent)]
    Digest(#[from] DigestError),
    /// Not a random duration.
    #[error(
        "{0:?} is not a duration: expected milliseconds such as 30, 60..110, lognormal:30,90, \
         recorded:FILE, file:CSV, drawn:CSV, 0.5 * file:CSV or none"
    )]
    Draw(String),
    /// A factor that makes no durations.
    #[error(
        "{0:?} is not a duration: expected a factor from {least} to {greatest} before *",
        least = FACTORS.0,
        greatest = FACTORS.1
    )]
    Factor(String),
    /// A range with its ends exchanged.
    #[error("{0:?} is not a range: expected A..B, A first")]
    Range(String),
    /// A distribution without its two parameters.
    #[error("{0:?} is not a distribution: expected lognormal:MEDIAN,P99")]
    Lognormal(String),
    /// A distribution whose parameters make no sense.
    #[error(
        "{0:?} is not a distribution: expected lognormal:MEDIAN,P99, above zero and in this order"
    )]
    LognormalOrder(String),
    /// A column of durations without the name of its file.
    #[error("{0} names no file: expected {0}FILE")]
    NoFile(&'static str),
    /// A file without durations.
    #[error("{0} has no such durations: record a run on the real clock")]
    NoDurations(String),
    /// A file that has changed.
    #[error("{file} has other durations than it had: expected SHA-256 {expected}, found {found}")]
    OtherDurations {
        /// The file.
        file: String,
        /// The digest of its durations when they were first read.
        expected: Digest,
        /// Their digest now.
        found: Digest,
    },
    /// Not the error of a clock.
    #[error(
        "{0:?} is not a clock error: expected OFFSET_MS DRIFT_PPM, up to {ms} ms and {ppm} ppm \
         either way, or OFFSET_MS DRIFT_PPM STEP_MS",
        ms = MAX_OFFSET_MS,
        ppm = MAX_DRIFT_PPM
    )]
    Clock(String),
    /// Not an overrun policy.
    #[error("{0:?} is not an overrun policy: expected skip, catch-up or queue:N")]
    Overrun(String),
    /// Not a way to match messages.
    #[error(
        "{0:?} is not a way to match messages: expected each, every:SETS, exact:QUEUE, approximate:QUEUE or \
         approximate:QUEUE:MS"
    )]
    Match(String),
    /// A match with a queue that is not a queue depth.
    #[error("{0:?} is not a way to match messages: {1}")]
    MatchQueue(String, DepthError),
    /// A match with an interval that is not a duration.
    #[error("{0:?} is not a way to match messages: {1}")]
    MatchInterval(String, MillisError),
}

/// Returns names as alternatives: `a, b or c`.
pub fn alternatives<S: Borrow<str>>(names: &[S]) -> String {
    match names {
        [others @ .., last] if !others.is_empty() => {
            format!("{} or {}", others.join(", "), last.borrow())
        }
        names => names.concat(),
    }
}
