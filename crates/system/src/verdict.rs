//! The verdict of a run.

use std::{borrow::Cow, fmt};

use ratelab::{ClockExit, Time};

/// A kind of result of a system's runs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VerdictKind {
    /// A one-word name for programs, such as `pole_fell`.
    pub name: Cow<'static, str>,
    /// Whether the run is lost: the robot failed at its purpose.
    pub lost: bool,
    /// Text to print. `{at}` stands for the run time.
    pub text: Cow<'static, str>,
}

impl VerdictKind {
    /// The run reached its end.
    pub const COMPLETED: Self = Self::held("completed", "COMPLETED at {at}");
    /// A command stopped the run.
    pub const STOPPED: Self = Self::held("stopped", "STOPPED at {at}");
    /// A node ended the run.
    pub const ENDED: Self = Self::held("ended", "ENDED at {at} (by a node)");

    /// A kind of runs that are not lost.
    pub const fn held(name: &'static str, text: &'static str) -> Self {
        Self {
            name: Cow::Borrowed(name),
            lost: false,
            text: Cow::Borrowed(text),
        }
    }

    /// A kind of runs that are lost.
    pub const fn lost(name: &'static str, text: &'static str) -> Self {
        Self {
            name: Cow::Borrowed(name),
            lost: true,
            text: Cow::Borrowed(text),
        }
    }

    /// The kinds that depend only on the reason for the end of a run.
    pub(crate) const OF_EXITS: [Self; 3] = [Self::COMPLETED, Self::STOPPED, Self::ENDED];
}

/// The result of a run, with its run time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Verdict {
    /// Kind of the result.
    pub kind: VerdictKind,
    /// Run time of the result.
    pub at: Time,
}

impl Verdict {
    /// Creates a verdict at run time `at`.
    pub const fn new(kind: VerdictKind, at: Time) -> Self {
        Self { kind, at }
    }

    /// The verdict on a run of which only the reason for its end is known.
    pub fn from_exit(exit: &ClockExit, at: Time) -> Self {
        let kind = match exit {
            ClockExit::Completed => VerdictKind::COMPLETED,
            ClockExit::Ended { .. } => VerdictKind::ENDED,
            ClockExit::Stopped | ClockExit::HandedOver(_) => VerdictKind::STOPPED,
        };
        Self { kind, at }
    }

    /// Whether the run is lost.
    pub fn is_lost(&self) -> bool {
        self.kind.lost
    }

    /// A one-word name for programs.
    pub fn name(&self) -> &str {
        &self.kind.name
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.kind.text.replace("{at}", &self.at.to_string()))
    }
}
