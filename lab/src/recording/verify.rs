//! Runs a recorded run again and compares, bit for bit.

use std::{
    fmt,
    sync::atomic::{AtomicBool, Ordering},
    thread,
    time::Duration,
};

use crossbeam_channel::Sender;
use ratelab::{
    cartpole::mujoco_version,
    experiment::{ACTION, Config, Experiment, OBS, RunEnd, STATE, SetupError, TimedKnob},
    policy::Shelf,
    runtime::{
        ClockKind, Command, Fault, Fields, Payload, RealClock, Speed, Tap, Tapped, Time,
        telemetry::{Event, Happening},
    },
};
use thiserror::Error;

use super::{
    reader::{Head, Recording, Track},
    schema::{End, Outcome, platform},
};

/// Run time that a run may go on after it ended when it was recorded, until that
/// is what is different.
const GRACE: Duration = Duration::from_secs(1);

/// Run time for which a run may say nothing: that of the slowest sensor there
/// can be.
const SILENCE: Duration = Duration::from_secs(1_000);

/// Messages that may wait to be compared.
const BACKLOG: usize = 1024;

/// Why a recording cannot be run again, or is not what comes of it.
#[derive(Debug, Error)]
pub enum VerifyError {
    /// The order of what happened is not in the recording.
    #[error(
        "this run was {0} under the real clock, where the system decides in which order \
         threads run: the same run does not come twice, so there is nothing to verify"
    )]
    RealClock(&'static str),
    /// There is nothing in it.
    #[error("there is nothing in it to verify: no message of {0} was recorded")]
    Nothing(&'static str),
    /// The run that comes of it is another one.
    #[error("{difference}{}", if_made_elsewhere(.made))]
    Differs {
        /// Where.
        difference: Box<Difference>,
        /// By what it was made, if by other software than this.
        made: Option<String>,
    },
    /// It cannot be run at all.
    #[error(transparent)]
    Setup(#[from] SetupError),
}

fn if_made_elsewhere(made: &Option<String>) -> String {
    let made = made.as_ref();
    made.map_or_else(String::new, |made| format!(" (it was made with {made})"))
}

/// The first thing that is not the same.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Run time of it.
    pub at: Time,
    /// What it is.
    pub what: String,
    /// What was recorded.
    pub recorded: String,
    /// What came of running it again.
    pub computed: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            at,
            what,
            recorded,
            computed,
        } = self;
        write!(
            f,
            "differs at {at}: {what}: recorded {recorded}, computed {computed}"
        )
    }
}

/// What was found to be the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identical {
    /// Topics compared.
    pub topics: usize,
    /// Messages compared.
    pub messages: usize,
}

impl fmt::Display for Identical {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let messages = thousands(self.messages);
        write!(f, "identical, {} topics, {messages} messages", self.topics)
    }
}

/// With commas between groups of three digits.
fn thousands(number: usize) -> String {
    let digits = number.to_string();
    let groups: Vec<&str> = digits
        .as_bytes()
        .rchunks(3)
        .rev()
        .filter_map(|group| std::str::from_utf8(group).ok())
        .collect();
    groups.join(",")
}

/// Runs what `recording` says was run, with the commands that were given, and
/// compares every message and how the run ended. Ticks are not compared: what
/// they did is in the messages.
///
/// # Errors
/// [`VerifyError`] if it is not the same, or cannot be told.
pub fn verify(recording: &Recording) -> Result<Identical, VerifyError> {
    refuse_real_clock(recording)?;
    let tracks = [OBS, ACTION, STATE].map(|name| (name, recording.track(name)));
    for (name, track) in tracks {
        // A policy too slow for a short recording is silent in it.
        if track.is_none_or(|track| name != ACTION && track.heads.is_empty()) {
            return Err(VerifyError::Nothing(name));
        }
    }
    let mut differences = run_again(recording, tracks.map(|(_, track)| track))?;
    differences.sort_by_key(|difference| difference.at);
    match differences.into_iter().next() {
        Some(difference) => Err(VerifyError::Differs {
            difference: Box::new(difference),
            made: made_elsewhere(recording),
        }),
        None => Ok(Identical {
            topics: tracks.len(),
            messages: tracks
                .iter()
                .flat_map(|(_, track)| track)
                .map(|t| t.heads.len())
                .sum(),
        }),
    }
}

fn refuse_real_clock(recording: &Recording) -> Result<(), VerifyError> {
    let handed_over = |event: &Event| {
        matches!(
            event.what,
            Happening::Applied {
                command: Command::HandOver(ClockKind::Real),
                ..
            }
        )
    };
    match recording.origin.config.clock {
        ClockKind::Real => Err(VerifyError::RealClock("begun")),
        _ if recording.events.iter().any(handed_over) => Err(VerifyError::RealClock("for a while")),
        _ => Ok(()),
    }
}

/// What made the recording, if that may compute other bits than this program.
fn made_elsewhere(recording: &Recording) -> Option<String> {
    let origin = &recording.origin;
    let ours = (env!("CARGO_PKG_VERSION"), mujoco_version(), platform());
    let theirs = (&*origin.ratelab, &*origin.mujoco, origin.platform.clone());
    (ours != theirs).then(|| {
        let (ratelab, mujoco, platform) = theirs;
        format!("ratelab {ratelab}, MuJoCo {mujoco}, {platform}")
    })
}

/// Runs it again; what is different.
fn run_again(
    recording: &Recording,
    [observed, acted, stepped]: [Option<&Track>; 3],
) -> Result<Vec<Difference>, VerifyError> {
    let whole = recording
        .outcome
        .as_ref()
        .filter(|outcome| outcome.end != End::WentOn);
    let config = config_again(recording, whole);
    let turned = recording.events.iter().filter_map(TimedKnob::of);
    let turned: Vec<TimedKnob> = turned.collect();
    let swaps = turned.iter().filter_map(|timed| timed.knob.brain());
    // What cannot be had any more is said before anything is compared.
    let shelf = Shelf::of(config.brains().chain(swaps)).map_err(SetupError::from)?;
    let mut experiment = Experiment::with_shelf(&config, shelf)?;
    let commands = recording.events.iter().filter_map(Event::replayable);
    experiment.schedule(commands.collect());
    let taps = experiment.taps();
    let observations = taps.observations(BACKLOG);
    let actions = taps.actions(BACKLOG);
    let steps = taps.steps(BACKLOG);
    drop(taps);
    let complete = whole.is_some();
    let halt = Halt {
        found: AtomicBool::new(false),
        commands: experiment.commands(),
    };
    let (mut differences, outcome) = thread::scope(|scope| {
        let halt = &halt;
        let checks = [
            scope.spawn(move || compare(OBS, observed, observations, complete, halt)),
            scope.spawn(move || compare(ACTION, acted, actions, complete, halt)),
            scope.spawn(move || compare(STATE, stepped, steps, complete, halt)),
        ];
        let outcome = experiment.run(&mut RealClock::default());
        let found = checks.into_iter().filter_map(|check| check.join().ok()?);
        (found.collect::<Vec<_>>(), outcome)
    });
    if differences.is_empty() {
        let ended = outcome.map(|summary| summary.end());
        differences.extend(whole.and_then(|outcome| compare_end(&outcome.end, outcome.at, &ended)));
    }
    Ok(differences)
}

/// What to run: no longer than there is something to compare with, and what
/// ended early may not end at all now.
fn config_again(recording: &Recording, whole: Option<&Outcome>) -> Config {
    let given = &recording.origin.config;
    let stamps = recording
        .topics
        .iter()
        .filter_map(|topic| topic.heads.last());
    let last = stamps.map(|head| head.stamp).max().unwrap_or(Time::ZERO);
    Config {
        clock: ClockKind::Virtual,
        speed: Speed::FlatOut,
        think: Duration::ZERO,
        knobs: Vec::new(),
        end: match whole {
            Some(outcome) => given.end.min(outcome.at.min(last + SILENCE) + GRACE),
            None => recording.until.min(last),
        },
        ..given.clone()
    }
}

/// Compares the messages of a topic as they come with those that were recorded.
/// Recordings may begin later than runs, and if not `complete` end earlier.
fn compare<T: Fields + Payload>(
    name: &str,
    track: Option<&Track>,
    tap: Tap<Tapped<T>>,
    complete: bool,
    halt: &Halt,
) -> Option<Difference> {
    // The tap goes with the first difference: the run no longer waits for it.
    let difference = first_difference::<T>(name, track?, &tap, complete, halt)?;
    halt.found.store(true, Ordering::Relaxed);
    let _ = halt.commands.send(Command::Stop); // It may be over.
    Some(difference)
}

/// Ends the run when a difference is found.
struct Halt {
    found: AtomicBool,
    commands: Sender<Command>,
}

fn first_difference<T: Fields + Payload>(
    name: &str,
    track: &Track,
    tap: &Tap<Tapped<T>>,
    complete: bool,
    halt: &Halt,
) -> Option<Difference> {
    let mut index = 0;
    let mut row = Vec::new();
    let first = track.heads.first().map(|head| head.seq);
    for tapped in tap.items() {
        if first.is_some_and(|first| tapped.message.seq < first) {
            continue;
        }
        let head = Head {
            stamp: tapped.message.stamp,
            seq: tapped.message.seq,
            origin: tapped.message.origin,
            dropped: tapped.dropped,
        };
        let Some(recorded) = track.heads.get(index) else {
            return complete.then(|| nothing_there(name, &head, "recorded"));
        };
        row.clear();
        tapped.message.data.append_to(&mut row);
        if let Some(difference) = compare_message(name, recorded, &head)
            .or_else(|| compare_values::<T>(name, recorded, track.row(index), &row))
        {
            return Some(difference);
        }
        index += 1;
    }
    let missing = track.heads.get(index)?;
    // A run that was ended because of another difference lacks what came after.
    let ended = halt.found.load(Ordering::Relaxed);
    (!ended).then(|| nothing_there(name, missing, "computed"))
}

fn nothing_there(name: &str, head: &Head, missing: &str) -> Difference {
    let (here, nothing) = ("a message".to_owned(), "none".to_owned());
    let (recorded, computed) = if missing == "recorded" {
        (nothing, here)
    } else {
        (here, nothing)
    };
    Difference {
        at: head.stamp,
        what: format!("{name} message {}", head.seq),
        recorded,
        computed,
    }
}

fn compare_message(name: &str, recorded: &Head, computed: &Head) -> Option<Difference> {
    let differ = |what: &str, recorded_text: String, computed_text: String| Difference {
        at: recorded.stamp,
        what: format!("{name} message {}, {what}", recorded.seq),
        recorded: recorded_text,
        computed: computed_text,
    };
    let nanos = |time: Time| format!("{} ns", time.as_nanos());
    let origin = |head: &Head| head.origin.map_or("none".to_owned(), nanos);
    if recorded.seq != computed.seq {
        let (recorded, computed) = (recorded.seq.to_string(), computed.seq.to_string());
        Some(differ("sequence number", recorded, computed))
    } else if recorded.stamp != computed.stamp {
        Some(differ(
            "stamp",
            nanos(recorded.stamp),
            nanos(computed.stamp),
        ))
    } else if recorded.origin != computed.origin {
        Some(differ("origin", origin(recorded), origin(computed)))
    } else if recorded.dropped != computed.dropped {
        let (recorded, computed) = (recorded.dropped.to_string(), computed.dropped.to_string());
        Some(differ("messages dropped by then", recorded, computed))
    } else {
        None
    }
}

fn compare_values<T: Fields>(
    name: &str,
    head: &Head,
    recorded: &[f64],
    computed: &[f64],
) -> Option<Difference> {
    let number = |value: Option<&f64>| match value {
        Some(value) => format!("{value:?} ({:#018x})", value.to_bits()),
        None => "nothing".to_owned(),
    };
    let bits = |row: &[f64], index: usize| row.get(index).map(|value| value.to_bits());
    let fields = 0..recorded.len().max(computed.len());
    let index = fields
        .into_iter()
        .find(|&index| bits(recorded, index) != bits(computed, index))?;
    let field = T::FIELDS.get(index).copied().unwrap_or("a number more");
    Some(Difference {
        at: head.stamp,
        what: format!("{name} message {}, {field}", head.seq),
        recorded: number(recorded.get(index)),
        computed: number(computed.get(index)),
    })
}

/// Compares how the run ended.
fn compare_end(recorded: &End, at: Time, computed: &Result<RunEnd, Fault>) -> Option<Difference> {
    let tell = |end: &RunEnd| {
        let steps = end.steps;
        format!("{} after {steps} control steps", end.verdict)
    };
    let recorded = match recorded {
        End::Ended(end) => tell(end),
        End::Failed { fault } => fault.clone(),
        End::WentOn => return None,
    };
    let computed = match computed {
        Ok(end) => tell(end),
        Err(fault) => fault.to_string(),
    };
    (recorded != computed).then(|| Difference {
        at,
        what: "the end of the run".to_owned(),
        recorded,
        computed,
    })
}
