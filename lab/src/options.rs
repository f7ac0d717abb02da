//! From what was typed to a configuration.

use std::{fmt, path::Path};

use ratelab::{
    cartpole::CONTROL_HZ,
    experiment::{BROKEN_HZ, Config, TimedKnob, parse_knobs},
    file::{self, FileError},
    policy::PolicyCache,
    runtime::{ClockKind, Hz, Speed, Time, clock::RealtimePriority},
};

use crate::{
    cli::{ClockArg, GraphArgs, RunArgs},
    error::Error,
    output::note,
};

/// What holds where nothing is said.
#[derive(Clone, Copy)]
pub struct Defaults {
    /// The clock to begin with.
    pub clock: ClockKind,
    /// When the run ends.
    pub end: Time,
    /// How fast virtual time passes.
    pub speed: Speed,
}

/// The largest file of knobs that is read (bytes): some million of them.
const MOST_KNOBS: u64 = 16 << 20;

/// Run time of `--smoke`.
const SMOKE: Time = Time::from_nanos(2_000_000_000);

/// The configuration that the options describe.
///
/// Its policy is read into `policies`.
pub fn config(
    args: &RunArgs,
    defaults: &Defaults,
    policies: &PolicyCache,
) -> Result<Config, Error> {
    if !args.smoke {
        return graph(&args.graph, defaults, policies);
    }
    if args.graph.clock == Some(ClockArg::Real) {
        let why = "--smoke runs on the virtual clock: leave --clock real out";
        return Err(Error::BadInput(why.to_owned()));
    }
    let smoke = Defaults {
        clock: ClockKind::Virtual,
        end: SMOKE,
        ..*defaults
    };
    graph(&args.graph, &smoke, policies)
}

fn graph(args: &GraphArgs, defaults: &Defaults, policies: &PolicyCache) -> Result<Config, Error> {
    let clock = args.clock.map_or(defaults.clock, ClockKind::from);
    check_clock(args, clock)?;
    let default_hz = if args.break_bug {
        BROKEN_HZ
    } else {
        CONTROL_HZ
    };
    let control_hz = match args.control_hz {
        Some(hz) => hz,
        None => Hz::new(default_hz).map_err(|error| Error::BadInput(error.to_string()))?,
    };
    let policy = policies.pin(&args.policy);
    let policy = policy.map_err(|error| Error::BadInput(format!("--policy {error}")))?;
    Ok(Config {
        seed: args.seed,
        clock,
        speed: args.speed.unwrap_or(defaults.speed),
        end: args.duration_s.unwrap_or(defaults.end),
        sensor_hz: args.sensor_hz,
        control_hz,
        queue_depth: args.queue_depth,
        policy,
        think: args.think_ms.unwrap_or_default(),
        knobs: args.knobs.as_deref().map_or(Ok(Vec::new()), read_knobs)?,
    })
}

/// Refuses what has no meaning on the chosen clock.
fn check_clock(args: &GraphArgs, clock: ClockKind) -> Result<(), Error> {
    let why = match clock {
        ClockKind::Virtual if args.realtime => {
            "--realtime has no meaning on the virtual clock: add --clock real"
        }
        ClockKind::Virtual if args.think_ms.is_some() => {
            "--think-ms takes wall time, which the virtual clock does not know: add --clock real"
        }
        ClockKind::Real if args.speed.is_some() => {
            "--speed sets the pace of virtual time: add --clock virtual"
        }
        _ => return Ok(()),
    };
    Err(Error::BadInput(why.to_owned()))
}

fn read_knobs(path: &Path) -> Result<Vec<TimedKnob>, Error> {
    let refused =
        |why: &dyn fmt::Display| Error::BadInput(format!("--knobs {}: {why}", path.display()));
    let content = file::read(path, MOST_KNOBS).map_err(|error| match error {
        FileError::Unreadable(why) => Error::file("--knobs", path, &why),
        other => refused(&format!(
            "expected a text file of {MOST_KNOBS} bytes at most, {other}"
        )),
    })?;
    let text = String::from_utf8(content);
    let text = text.map_err(|_| refused(&"expected a text file in UTF-8, found other bytes"))?;
    let knobs = parse_knobs(&text).map_err(|error| refused(&error))?;
    let pinned = knobs.into_iter().map(TimedKnob::pinned);
    pinned
        .collect::<Result<_, _>>()
        .map_err(|error| refused(&error))
}

/// Asks for real-time priority if that was asked for, and says so if it is
/// refused.
pub fn realtime(args: &GraphArgs) -> Option<Result<RealtimePriority, String>> {
    let asked = args.realtime.then(RealtimePriority::request)?;
    Some(asked.map_err(|refusal| {
        note(&format!("--realtime: {refusal}"));
        refusal.to_string()
    }))
}
