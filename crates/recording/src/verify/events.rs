//! Events and the order of threads, compared with the recorded ones.

use std::iter;

use ratelab::{ClockKind, Command, Event, EventKind, Knob, Time, TimedCommand};
use ratelab_re_execution::ReExecution;
use ratelab_system::{BuildError, System};

use super::{VerifyError, difference::Difference};
use crate::{durations::with_recorded, run::Recording};

/// Returns the commands to give again: commands that changed the graph, and commands that the graph
/// refused and will refuse again.
///
/// # Errors
/// [`BuildError::Setting`] if durations that a knob draws from cannot be had.
pub fn commands(
    recording: &Recording,
    system: &dyn System,
    re_execution: Option<&ReExecution>,
) -> Result<Vec<TimedCommand>, BuildError> {
    // A log of threads counts the events of a damaged file too.
    let threads = recording
        .threads
        .as_ref()
        .filter(|_| re_execution.is_some());
    let events = threads
        .map_or(&recording.events, |threads| &threads.events)
        .iter()
        .enumerate()
        .filter(|(index, _)| re_execution.is_none_or(|re_execution| !re_execution.knows(*index)));
    let commands = events.filter_map(|(_, event)| {
        let again = match &event.what {
            EventKind::Applied {
                command: command @ Command::HandOver(_),
                ..
            } => command,
            EventKind::Refused { command, .. } if is_up_to_the_graph(system, command) => command,
            _ => return event.replayable(),
        };
        let (at, command) = (event.at, again.clone());
        Some(TimedCommand { at, command })
    });
    let tabled = commands.map(|mut timed| {
        load_table(recording, &mut timed.command)?;
        Ok(timed)
    });
    tabled.collect()
}

/// Loads the measured durations that the knob of `command` draws from.
///
/// # Errors
/// [`BuildError::Setting`] if they cannot be had.
pub fn load_table(recording: &Recording, command: &mut Command) -> Result<(), BuildError> {
    if let Command::Set(knob) = command {
        *knob = with_table(recording, knob.clone())?;
    }
    Ok(())
}

/// Returns `knob` with the measured durations that it draws from: those of its file, or else of the
/// `recording`.
///
/// # Errors
/// [`BuildError::Setting`] if they cannot be had.
pub fn with_table(recording: &Recording, knob: Knob) -> Result<Knob, BuildError> {
    with_recorded(&recording.origin.durations, knob).map_err(BuildError::Setting)
}

/// Returns whether the graph alone decides what becomes of `command`. Of files it may be another
/// thing today, and commands of the other clock change it.
fn is_up_to_the_graph(system: &dyn System, command: &Command) -> bool {
    match command {
        Command::Set(_) => !names_a_file(system, command),
        command => *command == Command::HandOver(ClockKind::Virtual),
    }
}

/// Returns whether the content of a file decides what becomes of `command`.
pub fn names_a_file(system: &dyn System, command: &Command) -> bool {
    match command {
        Command::Set(Knob::Send { node, text }) => system.knobs().file(node, text).is_some(),
        _ => false,
    }
}

/// Returns whether `event` comes of running the run again: pauses and speeds are the wall's, and
/// why a file was refused is up to the file.
fn comes_again(system: &dyn System, event: &Event) -> bool {
    match &event.what {
        EventKind::Applied { command, .. } => !paces(command),
        EventKind::Refused { command, .. } => !names_a_file(system, command),
        EventKind::Ended { .. } | EventKind::Faulted { .. } | EventKind::Crashed { .. } => true,
        // Only of runs on the real clock.
        EventKind::Presence { .. } => false,
    }
}

/// Returns whether `command` merely changes how run time passes.
fn paces(command: &Command) -> bool {
    matches!(
        command,
        Command::Pause | Command::Resume | Command::Step | Command::Speed(_)
    )
}

/// Returns the first thing in what was recorded that no run can have: an event before the one
/// before it, a speed that was not the last one, a knob that was given and never turned.
///
/// Of a run with `threads` the log has the order, which is not that of time.
pub fn check(recording: &Recording, threads: bool) -> Option<Difference> {
    let config = &recording.origin.config;
    let (mut last, mut speed) = (Time::ZERO, config.speed);
    for event in &recording.events {
        if event.at < last && !threads {
            let before = format!("nothing before {last}");
            return Some(differs(event.at, event.to_string(), before));
        }
        last = event.at;
        let EventKind::Applied { command, was } = &event.what else {
            continue;
        };
        let before = match command {
            Command::Speed(next) => Some(std::mem::replace(&mut speed, *next).to_string()),
            command if paces(command) => None,
            _ => continue,
        };
        if *was != before {
            let was_before = before.map_or("none".to_owned(), |before| format!("was {before}"));
            return Some(differs(event.at, event.to_string(), was_before));
        }
    }
    if threads {
        // The wall decides when they come, and whether a node still reads them.
        None
    } else {
        first_knob_left_out(recording)
    }
}

/// Returns the first knob of the configuration that was due in the run and was not turned. Knobs of
/// the last moment may have come too late.
fn first_knob_left_out(recording: &Recording) -> Option<Difference> {
    let mut given: Vec<TimedCommand> = recording
        .origin
        .config
        .knobs
        .iter()
        .cloned()
        .map(TimedCommand::from)
        .collect();
    given.sort_by_key(|given| given.at);
    let mut events = recording.events.iter();
    let mut is_among = |given: &TimedCommand| {
        events.any(|event| match &event.what {
            EventKind::Applied { command, .. } | EventKind::Refused { command, .. } => {
                event.at == given.at && *command == given.command
            }
            _ => false,
        })
    };
    let left_out = given
        .iter()
        .filter(|given| given.at < recording.until)
        .find(|given| !is_among(given))?;
    let values = ["nothing of it".to_owned(), left_out.command.to_string()];
    Some(Difference::new(
        left_out.at,
        "a knob that was given",
        values,
    ))
}

/// Returns the first event that did not come again as it was recorded. If the recording is not
/// `complete`, events of its last moment may be missing.
pub fn compare(
    recording: &Recording,
    system: &dyn System,
    complete: bool,
    computed: &[Event],
) -> Option<Difference> {
    let again = |event: &&Event| comes_again(system, event);
    let recorded = recording.events.iter().filter(again);
    let computed = computed.iter().filter(again);
    let longer = recorded.clone().count().max(computed.clone().count());
    let recorded = recorded.map(Some).chain(iter::repeat(None));
    let computed = computed.map(Some).chain(iter::repeat(None));
    let mut pairs = recorded.zip(computed).take(longer);
    let (recorded, computed) = pairs.find(|(recorded, computed)| recorded != computed)?;
    match (recorded, computed) {
        (None, Some(event)) if !complete && event.at >= recording.until => None,
        _ => {
            let at = recorded.or(computed).map_or(Time::ZERO, |event| event.at);
            Some(differs(at, text(recorded), text(computed)))
        }
    }
}

fn differs(at: Time, recorded: String, computed: String) -> Difference {
    Difference::new(at, "an event", [recorded, computed])
}

fn text(event: Option<&Event>) -> String {
    event.map_or("none".to_owned(), |event| {
        format!("{event} ({} ns)", event.at.as_nanos())
    })
}

/// Prepares to execute a recorded run again as far as it was under the real clock; `None`
/// if it never was.
///
/// # Errors
/// [`VerifyError`] if its log is missing or wrong.
pub fn re_execution(
    recording: &Recording,
    system: &dyn System,
) -> Result<Option<ReExecution>, VerifyError> {
    let Some(when) = under_the_real_clock(recording) else {
        return Ok(None);
    };
    let Some(threads) = &recording.threads else {
        return Err(VerifyError::RealClock(when));
    };
    if let Some(damage) = threads.damage {
        return Err(VerifyError::Log(damage));
    }
    let topology = &recording.origin.topology;
    let read = if is_whole(recording) {
        ReExecution::new
    } else {
        ReExecution::from_torn
    };
    let mut re_execution = read(&threads.log, &threads.events, topology)?;
    re_execution.expect_refusals(|command| names_a_file(system, command));
    for command in re_execution.commands_mut() {
        load_table(recording, command)?;
    }
    Ok(Some(re_execution))
}

/// Returns whether the log goes on to the end of the run.
pub fn is_whole(recording: &Recording) -> bool {
    let threads = recording.threads.as_ref();
    let full = threads.is_some_and(|threads| threads.log.is_full());
    recording.is_whole() && recording.end_of_run().is_some() && !full
}

/// Returns when a run was under the real clock.
fn under_the_real_clock(recording: &Recording) -> Option<&'static str> {
    let handed_over =
        |event: &Event| matches!(event.applied(), Some(Command::HandOver(ClockKind::Real)));
    match recording.origin.config.clock {
        ClockKind::Real => Some("begun"),
        _ if recording.events.iter().any(handed_over) => Some("for a while"),
        _ => None,
    }
}
