//! A model of the machine of a real-clock run: the measured tick durations and lateness
//! of its nodes, drawn again in virtual time.

mod table;

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use ratelab::{ClockKind, Command, Event, Knob, KnobKind, TickTiming, Time, TimedKnob};
use ratelab_experiment::{Config, Experiment, Summary};
use ratelab_system::{System, measured::loaded};

use crate::{error::Error, program::Program, reading};
use ratelab_recording::{Recording, Replay, RunStatus, durations};
use thiserror::Error as ThisError;

pub use table::{json, text};

/// A recorded run on the real clock.
pub struct Like {
    /// The recording.
    pub file: PathBuf,
    /// That run in virtual time, with the measured timing.
    pub config: Config,
    /// The summary of the recorded run.
    pub recorded: Summary,
}

/// Reads the recording at `file`.
///
/// # Errors
/// [`Error::BadInput`] unless it is a complete recording of the program's system on the
/// real clock.
pub fn read(program: &Program, file: &Path) -> Result<Like, Error> {
    let refused = |why: LikeError| Error::BadInput(format!("--like {}: {why}", file.display()));
    let recording = reading::read(file)?;
    check(program, &recording).map_err(refused)?;
    let config = config(&program.system, &recording).map_err(refused)?;
    let mut replay = Replay::new(Arc::new(recording), &program.system);
    replay.advance_to(Time::MAX);
    Ok(Like {
        file: file.to_owned(),
        config,
        recorded: replay.summary(),
    })
}

/// Why a run cannot be like the recorded one.
#[derive(Debug, ThisError)]
enum LikeError {
    #[error("this is a recording of another version of the graph {0}: record this one")]
    OtherVersion(String),
    #[error("this is a recording of the graph file {0}: give that file, too, before --like")]
    GraphFile(String),
    #[error("this is a recording of the system {found}: expected one of {expected}")]
    OtherSystem { found: String, expected: String },
    #[error("{0}: a recording starts no program")]
    Program(String),
    #[error("{0}; expected a whole recording")]
    Defect(String),
    #[error(
        "this run was on the virtual clock, which measures no machine: record one on the real \
         clock, from its beginning to its end"
    )]
    Virtual,
    #[error("{0}")]
    Refused(String),
}

impl LikeError {
    fn refused(reason: impl ToString) -> Self {
        Self::Refused(reason.to_string())
    }
}

fn check(program: &Program, recording: &Recording) -> Result<(), LikeError> {
    let system = &*program.system;
    if !recording.is_of(system) {
        let (of, expected) = (&recording.origin.system, system.name());
        if of == expected {
            return Err(LikeError::OtherVersion(of.clone()));
        }
        return Err(match recording.origin.graph_file {
            Some(_) => LikeError::GraphFile(of.clone()),
            None => LikeError::OtherSystem {
                found: of.clone(),
                expected: expected.to_owned(),
            },
        });
    }
    if let Some(knob) = recording.program_in_disguise(system) {
        return Err(LikeError::Program(knob.to_string()));
    }
    if let Some(defect) = recording.defect() {
        return Err(LikeError::Defect(defect.to_string()));
    }
    let handed_over = |event: &Event| matches!(event.applied(), Some(Command::HandOver(_)));
    let origin = &recording.origin.config;
    if origin.clock != ClockKind::Real || recording.events.iter().any(handed_over) {
        return Err(LikeError::Virtual);
    }
    Ok(())
}

/// Returns the recorded run in virtual time.
fn config(system: &Arc<dyn System>, recording: &Recording) -> Result<Config, LikeError> {
    let given = &recording.origin.config;
    let knobs = recording.events.iter().filter_map(Event::knob);
    // The real clock has a lateness of its own, whatever the knobs of that were set to.
    let is_ignored = |kind: KnobKind| kind.sets(TickTiming::Start);
    let knobs = knobs.filter(|timed| !is_ignored(timed.knob.kind()));
    // What is drawn gives way to the measurements.
    let stays = |knob: &&Knob| !is_ignored(knob.kind()) || knob.kind().is_drawn();
    let mut config = Config {
        clock: ClockKind::Virtual,
        end: end(system, recording),
        knobs: knobs.collect(),
        setup: given.setup.iter().filter(stays).cloned().collect(),
        ..given.clone()
    };
    let nodes = recording.origin.topology.nodes.iter();
    for node in nodes.map(|node| node.name.as_str()) {
        for kind in KnobKind::ALL.into_iter().filter(|kind| kind.is_drawn()) {
            if kind.sets(TickTiming::Duration) && is_costed_on_the_way(&config.knobs, node) {
                continue;
            }
            let knob =
                measured(recording, kind, node)?.filter(|knob| is_taken(system, &config, knob));
            config.setup.extend(knob);
        }
    }
    Ok(config)
}

/// Returns the end of the run: as configured, or where it was stopped.
fn end(system: &Arc<dyn System>, recording: &Recording) -> Time {
    let given = recording.origin.config.end;
    match recording.outcome.as_ref().map(|outcome| &outcome.end) {
        Some(RunStatus::Ended(end)) => {
            let lost = end.verdict.verdict(&**system).is_lost();
            if lost && given != Time::MAX {
                given
            } else {
                end.sim_time
            }
        }
        _ => recording.until,
    }
}

/// Returns whether the cost of `node` was changed during the run: the measurements then mix several
/// costs, and the configured ones are used.
fn is_costed_on_the_way(knobs: &[TimedKnob], node: &str) -> bool {
    knobs
        .iter()
        .map(|timed| &timed.knob)
        .any(|knob| knob.kind().sets(TickTiming::Duration) && knob.target() == node)
}

/// Returns the knob of this `kind` with the measurements of `node`; `None` without measurements.
fn measured(recording: &Recording, kind: KnobKind, node: &str) -> Result<Option<Knob>, LikeError> {
    let durations = durations(recording, kind, node);
    if durations.is_empty() {
        return Ok(None);
    }
    let spec = format!("recorded:{}", recording.path.display());
    let knob = kind.set(node, &spec).map_err(LikeError::refused)?;
    loaded(knob, |_, _| Ok(durations))
        .map(Some)
        .map_err(LikeError::refused)
}

/// Returns whether the graph accepts `knob`: a world that moves by itself refuses some.
fn is_taken(system: &Arc<dyn System>, config: &Config, knob: &Knob) -> bool {
    let config = Config {
        setup: config.setup.clone().with(knob.clone()),
        knobs: Vec::new(),
        ..config.clone()
    };
    Experiment::new(system.clone(), &config).is_ok()
}
