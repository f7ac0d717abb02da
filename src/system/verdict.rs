//! The verdict of a run.

use std::fmt;

use crate::runtime::{ClockExit, Time};

/// One of the ways in which the runs of a system come out.
#[derive(Debug, PartialEq, Eq)]
pub struct VerdictKind {
    /// One word for it, for programs, such as `pole_fell`.
    pub name: &'static str,
    /// Whether the run is lost: the robot failed at what it is for.
    pub lost: bool,
    /// The text to print. `{at}` stands for the run time.
    pub text: &'static str,
}

impl VerdictKind {
    /// The run reached its end.
    pub const COMPLETED: Self = Self {
        name: "completed",
        lost: false,
        text: "COMPLETED at {at}",
    };
    /// A command stopped the run.
    pub const STOPPED: Self = Self {
        name: "stopped",
        lost: false,
        text: "STOPPED at {at}",
    };
    /// A node ended the run.
    pub const ENDED: Self = Self {
        name: "ended",
        lost: false,
        text: "ENDED at {at} (by a node)",
    };

    /// Those that say no more than why a run stopped.
    pub(super) const OF_EXITS: &'static [&'static Self] =
        &[&Self::COMPLETED, &Self::STOPPED, &Self::ENDED];
}

/// How a run came out, and when that was known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Verdict {
    /// Which of the ways.
    pub kind: &'static VerdictKind,
    /// Run time.
    pub at: Time,
}

impl Verdict {
    /// `kind`, at run time `at`.
    pub const fn new(kind: &'static VerdictKind, at: Time) -> Self {
        Self { kind, at }
    }

    /// What can be said of a run of which no more is known than why it stopped.
    pub fn of_exit(exit: &ClockExit, at: Time) -> Self {
        let kind = match exit {
            ClockExit::Completed => &VerdictKind::COMPLETED,
            ClockExit::Ended { .. } => &VerdictKind::ENDED,
            ClockExit::Stopped | ClockExit::HandedOver(_) => &VerdictKind::STOPPED,
        };
        Self { kind, at }
    }

    /// Whether the run is lost.
    pub fn is_lost(&self) -> bool {
        self.kind.lost
    }

    /// One word for it, for programs.
    pub fn name(&self) -> &'static str {
        self.kind.name
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.kind.text.replace("{at}", &self.at.to_string()))
    }
}
