//! A model of the machine of a real-clock run: the measured tick durations and lateness
//! of its nodes, drawn again in virtual time.

mod table;

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use ratelab::{ClockKind, Command, Event, Knob, KnobKind, TickTiming, Time, TimedKnob};
use ratelab_study::{
    experiment::{Config, Experiment, Summary},
    measured::loaded,
    system::System,
};

use crate::{error::Error, program::Program, reading};
use ratelab_recording::{Recording, Replay, RunStatus, durations};

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
    let refused = |why: String| Error::BadInput(format!("--like {}: {why}", file.display()));
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

fn check(program: &Program, recording: &Recording) -> Result<(), String> {
    let system = &*program.system;
    if !recording.is_of(system) {
        let (of, expected) = (&recording.origin.system, system.name());
        if of == expected {
            return Err(format!(
                "this is a recording of another version of the graph {of}: record this one"
            ));
        }
        return Err(match recording.origin.graph_file {
            Some(_) => format!(
                "this is a recording of the graph file {of}: give that file, too, before --like"
            ),
            None => format!("this is a recording of the system {of}: expected one of {expected}"),
        });
    }
    if let Some(knob) = recording.program_in_disguise(system) {
        return Err(format!("{knob}: a recording starts no program"));
    }
    if let Some(defect) = recording.defect() {
        return Err(format!("{defect}; expected a whole recording"));
    }
    let handed_over = |event: &Event| matches!(event.applied(), Some(Command::HandOver(_)));
    let origin = &recording.origin.config;
    if origin.clock != ClockKind::Real || recording.events.iter().any(handed_over) {
        return Err(
            "this run was on the virtual clock, which measures no machine: record one on the \
             real clock, from its beginning to its end"
                .to_owned(),
        );
    }
    Ok(())
}

/// The recorded run in virtual time.
fn config(system: &Arc<dyn System>, recording: &Recording) -> Result<Config, String> {
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
            let knob = measured(recording, kind, node)?;
            let knob = knob.filter(|knob| is_taken(system, &config, knob));
            config.setup.extend(knob);
        }
    }
    Ok(config)
}

/// The end of the run: as configured, or where it was stopped.
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

/// Whether the cost of `node` was changed during the run: the measurements then mix
/// several costs, and the configured ones are used.
fn is_costed_on_the_way(knobs: &[TimedKnob], node: &str) -> bool {
    let mut knobs = knobs.iter().map(|timed| &timed.knob);
    knobs.any(|knob| knob.kind().sets(TickTiming::Duration) && knob.target() == node)
}

/// The knob of this `kind` with the measurements of `node`; `None` without measurements.
fn measured(recording: &Recording, kind: KnobKind, node: &str) -> Result<Option<Knob>, String> {
    let durations = durations(recording, kind, node);
    if durations.is_empty() {
        return Ok(None);
    }
    let spec = format!("recorded:{}", recording.path.display());
    let knob = kind.set(node, &spec).map_err(|error| error.to_string())?;
    loaded(knob, |_, _| Ok(durations)).map(Some)
}

/// Whether the graph accepts `knob`: a world that moves by itself refuses some.
fn is_taken(system: &Arc<dyn System>, config: &Config, knob: &Knob) -> bool {
    let config = Config {
        setup: config.setup.clone().with(knob.clone()),
        knobs: Vec::new(),
        ..config.clone()
    };
    Experiment::new(system.clone(), &config).is_ok()
}
