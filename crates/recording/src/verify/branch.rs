//! Leaves a recorded run at a moment, and goes on under the virtual clock with something changed.

use std::{sync::Arc, time::Duration};

use ratelab::{
    Clock, ClockExit, Command, Fault, Graph, Inbox, Knob, Speed, Time, TimedCommand, TimedKnob,
};
use ratelab_experiment::{Config, Experiment, Summary};
use ratelab_re_execution::ReExecution;
use ratelab_real_clock::RealClock;
use ratelab_system::{AnswersOfNodes, System, Verdict};

use super::{VerifyError, again, events};
use crate::run::Recording;

/// Run time of a branch that begins at the end of the run, or of an endless one.
const BRANCH: Duration = Duration::from_secs(10);

/// Where a recorded run is left, and what is changed there.
#[derive(Clone, Debug)]
pub struct Departure {
    /// Run time; the last rest of the nodes before it counts.
    pub at: Time,
    /// The knobs that are turned there.
    pub knobs: Vec<Knob>,
    /// End of the branch; `None` for that of the recorded run.
    pub end: Option<Time>,
    /// Speed of the virtual clock.
    pub speed: Speed,
}

/// A branch of a recorded run, ready to run.
pub struct Branch {
    /// Run time at which it leaves the recorded run.
    pub at: Time,
    /// The graph.
    pub experiment: Experiment,
    /// Executes the recorded part.
    pub clock: BranchClock,
}

/// Prepares to run `recording` of `system` again up to the `departure`, or to the last rest
/// of its nodes before; there it turns the knobs, and goes on under the virtual clock. Knobs
/// that were turned later in the recorded run are turned again.
///
/// # Errors
/// [`VerifyError`] if the run cannot be executed again, or does not have the knobs.
pub fn branch(
    recording: &Recording,
    system: &Arc<dyn System>,
    departure: &Departure,
) -> Result<Branch, VerifyError> {
    super::refuse_foreign(recording, system)?;
    let mut re_execution = events::re_execution(recording, &**system)?;
    let at = departure.at;
    let knobs = departure.knobs.iter().cloned();
    let config = Config {
        knobs: knobs.map(|knob| TimedKnob { at, knob }).collect(),
        end: departure.end.unwrap_or_else(|| end_of(recording, at)),
        speed: departure.speed,
        ..recording.origin.config.clone()
    };
    let mut config = again::with_tables(recording, config)?;
    let taken = recording.knobs();
    let build =
        |config: &Config| Experiment::again(system.clone(), config, &taken, AnswersOfNodes::new());
    let mut experiment = build(&config)?;
    let rest = re_execution
        .as_ref()
        .and_then(|re_execution| re_execution.rest_before(at, config.clock));
    if let (Some(re_execution), Some(_)) = (&mut re_execution, rest) {
        let knobs = experiment.config().knobs.iter();
        re_execution.branch(at, knobs.map(|timed| timed.knob.clone().into()).collect());
        config.knobs.clear();
        experiment = build(&config)?;
    }
    experiment.schedule(commands(recording, &**system, re_execution.as_ref(), at)?);
    Ok(Branch {
        at: rest.unwrap_or(at),
        experiment,
        clock: BranchClock {
            re_execution,
            left_at: at,
            real: RealClock::default(),
        },
    })
}

impl Branch {
    /// Runs it to its end.
    ///
    /// # Errors
    /// [`VerifyError`] if its recorded part did not come again.
    pub fn run(self) -> Result<Result<Summary, Fault>, VerifyError> {
        let mut clock = self.clock;
        let result = self.experiment.run_with(&mut clock);
        match clock
            .re_execution
            .as_ref()
            .and_then(ReExecution::difference)
        {
            Some(diverged) => Err(VerifyError::Diverged(diverged)),
            None => Ok(result),
        }
    }
}

/// Executes the recorded part of a branch under the real clock again; later it is the real
/// clock itself.
#[derive(Debug)]
pub struct BranchClock {
    re_execution: Option<ReExecution>,
    left_at: Time,
    real: RealClock,
}

impl Clock for BranchClock {
    fn cores(&self) -> Option<usize> {
        self.re_execution
            .as_ref()
            .map_or(self.real.cores(), ReExecution::cores)
    }

    fn run(
        &mut self,
        graph: &mut Graph,
        inbox: &mut Inbox,
        until: Time,
    ) -> Result<ClockExit, Fault> {
        let recorded = graph.now() <= self.left_at;
        match self
            .re_execution
            .as_mut()
            .filter(|re_execution| recorded && !re_execution.has_left())
        {
            Some(re_execution) => re_execution.run(graph, inbox, until),
            None => self.real.run(graph, inbox, until),
        }
    }
}

/// Returns the configured end, if the run has one and is left before it.
fn end_of(recording: &Recording, at: Time) -> Time {
    match recording.origin.config.end {
        end if end > at && end < Time::MAX => end,
        _ => recording.until.max(at + BRANCH),
    }
}

/// Returns the commands of the virtual clock up to run time `at`, and all knobs of later.
fn commands(
    recording: &Recording,
    system: &dyn System,
    re_execution: Option<&ReExecution>,
    at: Time,
) -> Result<Vec<TimedCommand>, VerifyError> {
    let mut commands = events::commands(recording, system, re_execution)?;
    commands.retain(|timed| timed.at <= at || matches!(timed.command, Command::Set(_)));
    let known =
        recording.events.iter().enumerate().filter(|(index, _)| {
            re_execution.is_some_and(|re_execution| re_execution.knows(*index))
        });
    let later = known.filter_map(|(_, event)| event.knob().filter(|timed| timed.at > at));
    commands.extend(later.map(TimedCommand::from));
    commands.sort_by_key(|timed| timed.at);
    Ok(commands)
}

/// A recorded run, and the change at which a branch left it.
pub struct Change {
    /// Run time at which the branch left it.
    pub at: Time,
    /// The verdict of the recorded run; `None` if that is unknown.
    pub recorded: Option<Verdict>,
    /// The knobs that were turned.
    pub knobs: String,
}

impl Change {
    /// Creates the change by `knobs` at which a branch of `recording` of `system` left it.
    pub fn new(recording: &Recording, system: &dyn System, at: Time, knobs: String) -> Self {
        let result = recording.result();
        Self {
            at,
            recorded: result.map(|result| result.verdict.verdict(system)),
            knobs,
        }
    }

    /// Returns the moment of the branch, and the one that was `asked` for if it is another.
    pub fn left(&self, asked: Time) -> String {
        if asked == self.at {
            asked.to_string()
        } else {
            format!("{}, the last rest of the nodes up to {asked}", self.at)
        }
    }

    /// Returns what the change made different; `branch` is the verdict of the branch, unless that
    /// goes on.
    pub fn sentence(&self, branch: Option<Verdict>) -> String {
        let Self { at, knobs, .. } = self;
        let before = self
            .recorded
            .as_ref()
            .map(in_short)
            .unwrap_or_else(|| "not lost so far".to_owned());
        match branch.map(|verdict| in_short(&verdict)) {
            Some(after) => format!("{before}; with {knobs} from {at} on: {after}"),
            None => format!("{before}; now with {knobs} from {at} on"),
        }
    }
}

/// Returns the text of a verdict inside a sentence, such as `fell at 0.580 s`.
fn in_short(verdict: &Verdict) -> String {
    let whole = verdict.to_string();
    let text = whole.split(" (").next().unwrap_or_default();
    let (word, rest) = text.split_at(text.find(' ').unwrap_or(text.len()));
    word.to_lowercase() + rest
}
