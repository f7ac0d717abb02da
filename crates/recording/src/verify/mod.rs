//! Runs a recorded run again and compares the two bit for bit.

mod again;
mod branch;
mod compare;
mod difference;
mod events;
mod execute;

use std::{fmt, ops::ControlFlow, sync::Arc};

use ratelab::{Time, Topology};
use ratelab_re_execution::LogError;
use ratelab_system::{AnswersOfNodes, BuildError, System};
use thiserror::Error;

pub use self::again::VerifyStatus;
pub use self::branch::{Branch, Departure, branch};
use self::difference::Difference;
pub use self::execute::{Executed, Execution, Held};
use crate::run::{Origin, Recording};
pub use branch::Change;

/// Why a run of the real clock does not come back, most likely.
const LIKELY: &str =
    "its nodes share something that is not a topic, read a clock, or a file was changed";

/// Why a recording cannot be run again, or is not what comes of it.
#[derive(Debug, Error)]
pub enum VerifyError {
    /// It is of another system than this program has.
    #[error(
        "this is a recording of {recorded:?}, and the system of this program is {known:?}: \
         verify it with the program that has {recorded:?}"
    )]
    OtherSystem {
        /// The system of the recording.
        recorded: String,
        /// That of this program.
        known: String,
    },
    /// Others than its nodes wrote to its topics.
    #[error(
        "this is one process of a run in several ({process}), and the network wrote to {topics} \
         between the reads of its nodes: the log of its threads has no order for that, so it \
         cannot be executed again"
    )]
    OneProcess {
        /// The process.
        process: String,
        /// The topics that others publish and its nodes read.
        topics: String,
    },
    /// It has what several processes sent, and the log of none.
    #[error(
        "this run was in several processes ({0}), and is recorded as a dashboard saw it, without \
         the log of any thread: it cannot be executed again"
    )]
    SeveralProcesses(String),
    /// The order of what happened is not in the recording.
    #[error(
        "this run was {0} under the real clock, and its recording lacks the order in which its \
         threads ran, as that of an early ratelab does: without it the same run does not come \
         twice, so there is nothing to verify"
    )]
    RealClock(&'static str),
    /// The order of what happened is not that of a run.
    #[error("{0}")]
    Order(#[from] LogError),
    /// The log of the threads is damaged.
    #[error("the log of its threads is damaged: {0}")]
    Log(&'static str),
    /// Executed in the recorded order, the nodes did something else.
    #[error("differs: {0}: {LIKELY}")]
    Diverged(String),
    /// There is nothing in it.
    #[error("there is nothing in it to verify: {0}")]
    Nothing(String),
    /// All that comes again is the same, and something else was changed.
    #[error(
        "differs: all that comes again is the same, and its digest is another: what does not \
         come of the run was changed, such as the configuration of a run of the real clock, or a \
         duration in wall time"
    )]
    Altered,
    /// The run that comes of it is another one.
    #[error("{difference}{why}")]
    Differs {
        /// Where.
        difference: Box<Difference>,
        /// Why, as far as that is known, and by what it was made, if by other software than this;
        /// each in brackets.
        why: String,
    },
    /// It has no digest.
    #[error(
        "all that comes again is the same, and nothing else is proven: this file has no digest, so \
         wall times, software and the list of --knobs may be other ones than those of the run"
    )]
    Unproven,
    /// Stopped by its watcher.
    #[error("stopped before all of it was compared")]
    Stopped,
    /// It cannot be run at all.
    #[error(transparent)]
    Setup(#[from] BuildError),
}

impl VerifyError {
    /// Returns the reason in a few words.
    pub fn brief(&self) -> &'static str {
        match self {
            Self::OtherSystem { .. } => "it is of another system",
            Self::OneProcess { .. } | Self::SeveralProcesses(_) => {
                "the run was in several processes"
            }
            Self::RealClock(_) => "it lacks the order of its threads",
            Self::Order(LogError::Outside(_)) => "a thread outside of the graph wrote to it",
            Self::Order(_) | Self::Log(_) => "the log of its threads is damaged",
            Self::Diverged(_) | Self::Differs { .. } => "this program runs it differently",
            Self::Nothing(_) => "too little of it was recorded",
            Self::Altered => "it was changed",
            Self::Unproven => "it has no digest",
            Self::Stopped => "the execution was stopped",
            Self::Setup(_) => "it cannot be set up here",
        }
    }
}

/// The result of a comparison without differences.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Identical {
    /// Topics compared, of which something was recorded.
    pub topics: usize,
    /// Messages compared.
    pub messages: usize,
    /// Ticks compared.
    pub ticks: usize,
    /// Run time up to which it was compared, if the rest is damaged or cannot be executed
    /// again.
    pub until: Option<Time>,
    /// Whether the file has no digest, so that the rest of its content was not compared.
    pub without_digest: bool,
    /// The other software than this that made it, as the file has it.
    pub made_by: Option<String>,
}

impl fmt::Display for Identical {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [messages, ticks] = [self.messages, self.ticks].map(thousands);
        let topics = self.topics;
        write!(
            f,
            "identical, {topics} topics, {messages} messages, {ticks} ticks"
        )?;
        if let Some(until) = self.until {
            write!(f, ", up to {until}")?;
        }
        if self.without_digest {
            f.write_str("; without a digest: wall times, software and --knobs are not proven")?;
        }
        match &self.made_by {
            Some(software) => write!(f, "; the file says that {software} made it"),
            None => Ok(()),
        }
    }
}

/// With commas between groups of three digits.
fn thousands(number: usize) -> String {
    match number / 1_000 {
        0 => number.to_string(),
        rest => format!("{},{:03}", thousands(rest), number % 1_000),
    }
}

/// How a recorded run is compared.
#[derive(Clone, Copy, Debug, Default)]
pub struct VerifyWith {
    /// Whether threads pause at random.
    pub perturb: bool,
    /// Whether programs are asked again; else the recording answers for them.
    pub asks: bool,
}

/// Runs the recorded run of `system` again with its commands, in the recorded order where it was
/// under the real clock, and compares the graph, every message, every tick, every event and the
/// end. What does not come of it, such as wall time, has a digest. `watch` looks on now and then,
/// and ends the comparison with a break.
///
/// # Errors
/// [`VerifyError`] if it is not the same, or that cannot be known.
pub fn verify(
    recording: &Recording,
    system: &Arc<dyn System>,
    VerifyWith { perturb, asks }: VerifyWith,
    watch: impl FnMut(&VerifyStatus) -> ControlFlow<()> + Send,
) -> Result<Identical, VerifyError> {
    refuse_foreign(recording, system)?;
    // A part of a run has ticks; a whole one may have none.
    if recording.ticks.iter().all(Vec::is_empty)
        && let Some(defect) = recording.defect()
    {
        return Err(VerifyError::Nothing(defect));
    }
    let answers = if asks {
        AnswersOfNodes::new()
    } else {
        recording.answers(&**system)
    };
    let mut re_execution = events::re_execution(recording, &**system)?;
    if let Some(re_execution) = re_execution.as_mut().filter(|_| perturb) {
        re_execution.perturb();
    }
    let identical = again::compare(recording, system, answers, re_execution, watch)?;
    if recording.altered && recording.is_whole() {
        Err(VerifyError::Altered)
    } else if identical.without_digest && recording.is_whole() {
        Err(VerifyError::Unproven)
    } else {
        let made_by = made_elsewhere(recording, system);
        Ok(Identical {
            made_by,
            ..identical
        })
    }
}

/// Returns the error for the first `difference` of a run; with `threads` it was under the real
/// clock, and may have `diverged` from the recorded order.
fn judge(
    recording: &Recording,
    system: &Arc<dyn System>,
    threads: bool,
    difference: Option<Difference>,
    diverged: Option<String>,
) -> Result<(), VerifyError> {
    let Some(difference) = difference else {
        return diverged.map_or(Ok(()), |diverged| Err(VerifyError::Diverged(diverged)));
    };
    let likely = || threads.then(|| format!("likely: {LIKELY}"));
    let made = made_elsewhere(recording, system);
    let reasons = diverged
        .or_else(likely)
        .into_iter()
        .chain(made.map(|made| format!("it was made with {made}")));
    Err(VerifyError::Differs {
        difference: Box::new(difference),
        why: reasons.map(|why| format!(" ({why})")).collect(),
    })
}

/// Refuses a run of another system, and a run whose message times the network decided: neither
/// can be executed again.
fn refuse_foreign(recording: &Recording, system: &Arc<dyn System>) -> Result<(), VerifyError> {
    if !recording.is_of(&**system) {
        return Err(VerifyError::OtherSystem {
            recorded: recording.origin.system.clone(),
            known: system.name().to_owned(),
        });
    }
    if let Some(knob) = recording.program_in_disguise(&**system) {
        let why = format!("{knob}: a recording starts no program");
        return Err(BuildError::Setting(why).into());
    }
    match (&*recording.origin.processes, &recording.threads) {
        ([], _) => Ok(()),
        ([process], Some(_)) => Err(VerifyError::OneProcess {
            process: process.to_string(),
            topics: from_others(&recording.origin.topology, &process.nodes).join(", "),
        }),
        (processes, _) => {
            let processes: Vec<_> = processes.iter().map(ToString::to_string).collect();
            Err(VerifyError::SeveralProcesses(processes.join("; ")))
        }
    }
}

/// Returns the topics that a process with the nodes `here` reads, and others publish.
fn from_others<'a>(graph: &'a Topology, here: &[String]) -> Vec<&'a str> {
    let is_here = |node: &usize| here.contains(&graph.nodes[*node].name);
    graph
        .topics
        .iter()
        .filter(|topic| topic.readers.iter().any(is_here))
        .filter(|topic| !topic.publishers.iter().all(is_here))
        .map(|topic| &*topic.name)
        .collect()
}

/// Returns the software of the recording, if it may compute other bits than this program.
fn made_elsewhere(recording: &Recording, system: &Arc<dyn System>) -> Option<String> {
    let Origin {
        config, topology, ..
    } = &recording.origin;
    let theirs = recording.origin.made_by();
    let ours = Origin::new(&**system, config.clone(), topology.clone()).made_by();
    (ours != theirs).then_some(theirs)
}
