//! What the runs of a system are worth: verdicts, limits for figures, and figures that it makes of
//! their messages: counts, means, and what deviations cost long before a run is lost.

use std::{borrow::Cow, fmt, time::Duration};

use ratelab::{ClockExit, Time};

use crate::Setup;

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

/// Adds up the messages of some recorded topics.
pub trait RunTally: Send {
    /// Returns the names of the topics.
    fn topics(&self) -> &'static [&'static str];

    /// Takes a message of `topic`, as its [`Fields`](ratelab_metrics::Fields).
    fn message(&mut self, topic: &str, row: &[f64]);

    /// Returns the figures so far.
    fn figures(&self) -> Vec<SystemFigure>;
}

/// A figure of a whole run, for tables and programs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SystemFigure {
    /// The block of figures that it belongs to; `None` for a figure on its own.
    pub block: Option<&'static str>,
    /// Name, such as `stalls`.
    pub name: &'static str,
    /// Its text for people, with `{}` for the value; empty for one that only programs need.
    pub text: &'static str,
    /// Value.
    pub value: FigureValue,
}

impl SystemFigure {
    /// Returns its text with the value in it; `None` without a text, or without a value.
    pub fn shown(&self) -> Option<String> {
        let value = match self.value {
            FigureValue::Count(count) => count.to_string(),
            FigureValue::Number(number) => format!("{:.3}", number?),
        };
        (!self.text.is_empty()).then(|| self.text.replace("{}", &value))
    }
}

/// The value of a [`SystemFigure`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FigureValue {
    /// A number of things.
    Count(u64),
    /// A quantity; `None` for a mean or a quantile of nothing.
    Number(Option<f64>),
}

/// The weighted sum of squares by which a system judges the states of its plant.
#[derive(Clone, Copy, Debug)]
pub struct QuadraticCost {
    /// The sum with its weights, for people, such as `(x/2.4 m)^2 + u^2`; in
    /// ASCII.
    pub sum: &'static str,
    /// The sum at a message of the topic of states, given as its
    /// [`Fields`](ratelab_metrics::Fields).
    pub of_state: fn(&[f64]) -> f64,
}

/// The mean of a [`QuadraticCost`] over run time: a state counts for as long as it is
/// the newest. Before the first there is no cost.
#[derive(Clone, Copy, Debug, Default)]
pub struct MeanCost {
    first: Option<Time>,
    since: Time,
    newest: f64,
    area: f64,
}

impl MeanCost {
    /// At run time `now` a state comes that costs `cost`.
    pub fn state(&mut self, now: Time, cost: f64) {
        self.area = self.area_at(now);
        self.first.get_or_insert(now);
        (self.since, self.newest) = (now, cost);
    }

    /// Returns the mean until run time `end`; `None` if no time has passed since the first
    /// state.
    pub fn until(&self, end: Time) -> Option<f64> {
        let time = end.since(self.first?).as_secs_f64();
        (time > 0.0).then(|| self.area_at(end) / time)
    }

    fn area_at(&self, now: Time) -> f64 {
        self.area + self.newest * now.since(self.since).as_secs_f64()
    }
}

/// A limit for a figure of a run, which `ratelab check` compares it with.
#[derive(Clone, Debug, PartialEq)]
pub struct FigureLimit {
    /// The figure, by its place in the metrics of a run, such as `nodes.detector.overruns`.
    pub figure: String,
    /// What it may be.
    pub bound: Bound,
    /// Line and column of its section in the graph file, counted from one.
    pub place: [usize; 2],
}

/// What a figure may be, in its own unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// This, or less.
    AtMost(f64),
    /// This, or more.
    AtLeast(f64),
}

/// By how much a figure may be beyond its bound, as a share of that: some last digits of a double,
/// which its sums and divisions round.
const ROUNDING: f64 = 1e-14;

impl Bound {
    /// Returns whether `value` is within it. A figure that is equal to it is, however its sums are
    /// rounded.
    pub fn holds(self, value: f64) -> bool {
        match self {
            Self::AtMost(most) => value <= most + most.abs() * ROUNDING,
            Self::AtLeast(least) => value >= least - least.abs() * ROUNDING,
        }
    }
}

impl fmt::Display for FigureLimit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.bound {
            Bound::AtMost(most) => write!(f, "{} at most {most}", self.figure),
            Bound::AtLeast(least) => write!(f, "{} at least {least}", self.figure),
        }
    }
}

#[cfg(test)]
mod tests {
    use ratelab::ClockKind;

    use super::*;

    fn at(seconds: f64) -> Time {
        Time::from_secs_f64(seconds).expect("a time")
    }

    #[test]
    fn the_reason_for_the_end_alone_loses_no_run() {
        let ended = ClockExit::Ended {
            node: "goal".to_owned(),
            at: at(1.5),
        };
        for (exit, name, text) in [
            (ClockExit::Completed, "completed", "COMPLETED at 1.500 s"),
            (ended, "ended", "ENDED at 1.500 s (by a node)"),
            (ClockExit::Stopped, "stopped", "STOPPED at 1.500 s"),
            (
                ClockExit::HandedOver(ClockKind::Real),
                "stopped",
                "STOPPED at 1.500 s",
            ),
        ] {
            let verdict = Verdict::from_exit(&exit, at(1.5));
            assert_eq!((verdict.name(), &*verdict.to_string()), (name, text));
            assert!(!verdict.is_lost(), "{name}");
        }
    }

    #[test]
    fn deviations_grow_without_a_loss_only_below_the_age_of_a_loss() {
        let ms = |ms: Option<u64>| ms.map(Duration::from_millis);
        for (grows, falls, swings) in [
            (Some(40), Some(60), Some(40)),
            (Some(40), None, Some(40)),
            (Some(60), Some(60), None),
            (Some(70), Some(60), None),
            (None, Some(60), None),
        ] {
            let limits = AgeLimits {
                grows: ms(grows),
                falls: ms(falls),
                may_fall: None,
            };
            assert_eq!(limits.swings(), ms(swings), "{grows:?} {falls:?}");
        }
    }

    #[test]
    fn a_figure_without_a_text_or_a_value_is_not_shown() {
        for (text, value, expected) in [
            ("{} stalls", FigureValue::Count(3), Some("3 stalls")),
            (
                "mean {} m",
                FigureValue::Number(Some(0.12349)),
                Some("mean 0.123 m"),
            ),
            ("mean {} m", FigureValue::Number(None), None),
            ("", FigureValue::Count(3), None),
        ] {
            let figure = SystemFigure {
                block: None,
                name: "figure",
                text,
                value,
            };
            assert_eq!(figure.shown().as_deref(), expected, "{text}");
        }
    }

    #[test]
    fn a_mean_cost_weighs_each_state_by_the_time_for_which_it_is_the_newest() {
        let mut cost = MeanCost::default();
        assert_eq!(cost.until(at(9.0)), None);
        cost.state(at(1.0), 2.0);
        assert_eq!(cost.until(at(1.0)), None);
        cost.state(at(2.0), 8.0);
        cost.state(at(2.0), 5.0);
        assert_eq!(cost.until(at(4.0)), Some((2.0 + 2.0 * 5.0) / 3.0));
    }

    #[test]
    fn a_figure_is_within_a_bound_that_it_equals_but_for_its_last_digits() {
        for (bound, value, holds) in [
            (Bound::AtMost(0.3), 0.1 + 0.2, true),
            (Bound::AtMost(0.3), 0.300_001, false),
            (Bound::AtMost(-0.3), -(0.1 + 0.2), true),
            (Bound::AtMost(-0.3), -0.299_999, false),
            (Bound::AtLeast(0.3), 0.299_999, false),
            (Bound::AtLeast(0.7), 1.0 - 0.3, true),
            (Bound::AtMost(0.0), 1e-300, false),
            (Bound::AtMost(1.0), f64::NAN, false),
            (Bound::AtLeast(1.0), f64::NAN, false),
        ] {
            assert_eq!(bound.holds(value), holds, "{bound:?} {value}");
        }
    }
}
