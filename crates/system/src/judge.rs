//! What the runs of a system are worth.

use std::{borrow::Cow, fmt, time::Duration};

use ratelab::{ClockExit, Time};

use crate::{QuadraticCost, RunTally, Setup};

/// Judges the runs of a [`System`](crate::System), which returns it from
/// [`System::judge`](crate::System::judge).
pub trait Judge {
    /// Returns the verdict on a run that stopped with `exit` at run time `at`. `state` is the
    /// newest message on the topic of [states](crate::About::state).
    fn verdict(&self, exit: &ClockExit, at: Time, state: Option<&[f64]>) -> Verdict {
        let _ = state;
        Verdict::from_exit(exit, at)
    }

    /// Returns all kinds that [`verdict`](Self::verdict) returns, so that they can be read from a
    /// recording. The first is that of a successful run.
    fn verdicts(&self) -> Vec<VerdictKind> {
        VerdictKind::OF_EXITS.to_vec()
    }

    /// Returns figures of the last `state` in a run.
    fn finals(&self, state: &[f64]) -> Vec<Final> {
        let _ = state;
        Vec::new()
    }

    /// Returns the final figures at run time `at`, the end of a run: for figures that change after the
    /// last message, such as an age.
    fn finals_at(&self, at: Time, state: &[f64]) -> Vec<Final> {
        let _ = at;
        self.finals(state)
    }

    /// Creates what adds up figures of a run with `setup` beside the figures of every run; `None`
    /// without any.
    fn tally(&self, setup: &Setup) -> Option<Box<dyn RunTally>> {
        let _ = setup;
        None
    }

    /// Returns the quadratic cost of states, which rates runs that are not lost; `None` without one.
    fn quadratic_cost(&self) -> Option<QuadraticCost> {
        None
    }

    /// Returns the reason why a run with `setup` is lost at any rate, such as a policy that does
    /// nothing; `None` without one.
    fn lost_anyway(&self, setup: &Setup) -> Option<String> {
        let _ = setup;
        None
    }

    /// Returns limits of the mean push age in a run with `setup`, less the part of it that plans
    /// [predicted](crate::PlayStep::predicted). The computation may be slow: callers cache it until
    /// the setup changes.
    fn age_limits(&self, setup: &Setup) -> AgeLimits {
        let _ = setup;
        AgeLimits::default()
    }
}

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

    /// Returns a kind of runs that are not lost.
    pub const fn held(name: &'static str, text: &'static str) -> Self {
        Self {
            name: Cow::Borrowed(name),
            lost: false,
            text: Cow::Borrowed(text),
        }
    }

    /// Returns a kind of runs that are lost.
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

    /// Returns the verdict on a run of which only the reason for its end is known.
    pub fn from_exit(exit: &ClockExit, at: Time) -> Self {
        let kind = match exit {
            ClockExit::Completed => VerdictKind::COMPLETED,
            ClockExit::Ended { .. } => VerdictKind::ENDED,
            ClockExit::Stopped | ClockExit::HandedOver(_) => VerdictKind::STOPPED,
        };
        Self { kind, at }
    }

    /// Returns whether the run is lost.
    pub fn is_lost(&self) -> bool {
        self.kind.lost
    }

    /// Returns a one-word name for programs.
    pub fn name(&self) -> &str {
        &self.kind.name
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.kind.text.replace("{at}", &self.at.to_string()))
    }
}

/// A figure of the last state of the plant, for tables and programs.
#[derive(Clone, Debug, PartialEq)]
pub struct Final {
    /// Name, such as `final_pole_angle`.
    pub name: Cow<'static, str>,
    /// Unit, such as `rad`.
    pub unit: Cow<'static, str>,
    /// Value.
    pub value: f64,
}

/// Limits of the mean push age of a control loop, where they are known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AgeLimits {
    /// Above this mean age small deviations grow.
    pub grows: Option<Duration>,
    /// From this mean age on, up to [`falls`](Self::falls), it depends on what makes the pushes
    /// old whether the run is lost.
    pub may_fall: Option<Duration>,
    /// Above this mean age the run is lost. It is borne where the age is constant.
    pub falls: Option<Duration>,
}

impl AgeLimits {
    /// Returns the age at which deviations grow, if it is below the age of a loss.
    pub fn swings(self) -> Option<Duration> {
        let before = |grows: &Duration| self.falls.is_none_or(|falls| *grows < falls);
        self.grows.filter(before)
    }
}
