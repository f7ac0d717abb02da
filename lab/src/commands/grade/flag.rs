//! The kinds of flags. A flag is no judgement: of two copies nobody knows which is the
//! original, and an early version wrote files without marks.

use std::collections::BTreeMap;

use serde::Serialize;

/// The kinds of flags; each is a column of the CSV file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FlagKind {
    /// The reason, or the entry of the file, is another learner's as well.
    CopiedReason,
    /// The entry was changed outside of ratelab, or written by hand.
    Edited,
    /// The prediction is about a number that is not the learner's.
    ForeignSeed,
    /// The prediction was made again after the measurement.
    Redone,
    /// Another learner has the same session.
    CopiedRescue,
    /// The session was played from a list of knobs.
    Scripted,
    /// The reason is none.
    NoReason,
}

impl FlagKind {
    /// All of them, in the order of the columns.
    pub const ALL: [Self; 7] = [
        Self::CopiedReason,
        Self::Edited,
        Self::ForeignSeed,
        Self::Redone,
        Self::CopiedRescue,
        Self::Scripted,
        Self::NoReason,
    ];
}

/// Their columns in the CSV file.
pub const COLUMNS: &str =
    "copied_reason,edited,foreign_seed,redone,copied_rescue,scripted,no_reason";

/// Flags of a prediction or a session, with the evidence.
pub type Flags = BTreeMap<FlagKind, String>;
