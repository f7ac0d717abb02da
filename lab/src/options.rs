//! Builds a configuration from the command line.

use std::{fmt, path::Path};

use ratelab::{ClockKind, Knob, Speed, TickTiming, Time, TimedKnob};
use ratelab_experiment::{Config, Experiment};
use ratelab_real_clock::{RealtimeError, RealtimePriority};
use ratelab_system::{Setup, WorldKind, file};

use crate::{
    cli::{ClockArg, GraphArgs, RunArgs, TimingArgs, WorldArg},
    error::Error,
    like::{self, Like},
    output::note,
    program::Program,
};
use ratelab_recording::with_durations;

/// Defaults of a command.
#[derive(Clone, Copy)]
pub struct Defaults {
    /// The initial clock.
    pub clock: ClockKind,
    /// Run time at the end.
    pub end: Time,
    /// Speed of virtual time.
    pub speed: Speed,
    /// Why it has no runs on the real clock, if it has none.
    pub virtual_only: Option<&'static str>,
}

/// The lab starts in virtual time, because runs are reproducible there.
pub const LAB: Defaults = Defaults {
    clock: ClockKind::Virtual,
    end: Time::MAX,
    speed: Speed::REAL_TIME,
    virtual_only: None,
};

/// A run without a dashboard takes ten seconds, by the wall unless asked otherwise.
pub const RUN: Defaults = Defaults {
    clock: ClockKind::Real,
    end: Time::from_nanos(10_000_000_000),
    speed: Speed::Unlimited,
    virtual_only: None,
};

impl Defaults {
    /// Creates the defaults of a run that is on the virtual clock only, for a reason.
    pub const fn virtual_only(why: &'static str) -> Self {
        Self {
            clock: ClockKind::Virtual,
            virtual_only: Some(why),
            ..RUN
        }
    }

    /// Returns the configuration without options.
    pub fn config(&self) -> Config {
        Config {
            clock: self.clock,
            end: self.end,
            speed: self.speed,
            ..Config::default()
        }
    }
}

/// The largest file of knobs accepted (bytes): enough for about a million.
const MAX_KNOBS: u64 = 16 << 20;

/// Run time of `--smoke`.
const SMOKE: Time = Time::from_nanos(2_000_000_000);

/// Builds the configuration from the options, and reads the run that it is to be like.
///
/// # Errors
/// [`Error::BadInput`] if they are invalid for the system.
pub fn config(
    program: &Program,
    args: &RunArgs,
    defaults: &Defaults,
) -> Result<(Config, Option<Like>), Error> {
    if !args.smoke {
        return graph(program, &args.graph, defaults);
    }
    let smoke = Defaults {
        clock: ClockKind::Virtual,
        end: SMOKE,
        virtual_only: Some("--smoke runs on the virtual clock: leave --clock real out"),
        ..*defaults
    };
    graph(program, &args.graph, &smoke)
}

/// Builds the configuration from the options of a graph alone, and reads the run that it is
/// to be like.
///
/// # Errors
/// [`Error::BadInput`] if they are invalid for the system.
pub fn graph(
    program: &Program,
    args: &GraphArgs,
    defaults: &Defaults,
) -> Result<(Config, Option<Like>), Error> {
    if let (Some(ClockArg::Real), Some(why)) = (args.clock, defaults.virtual_only) {
        return Err(Error::BadInput(why.to_owned()));
    }
    let like = args
        .like
        .as_deref()
        .map(|file| like::read(program, file))
        .transpose()?;
    let usual = match &like {
        Some(like) => like.config.clone(),
        None => defaults.config(),
    };
    let clock = args.clock.map_or(usual.clock, ClockKind::from);
    check_clock(args, clock)?;
    let seed = args.seed.unwrap_or(usual.seed);
    let mut config = Config {
        seed,
        clock,
        speed: args.speed.unwrap_or(defaults.speed),
        end: args.duration_s.unwrap_or(usual.end),
        world: world(&args.timing, usual.world)?,
        ..usual
    };
    let setup = setup(program, seed, settings(program, args)?)?;
    config.setup.extend(setup.iter().cloned());
    if like.is_none() {
        config.knobs = program.system.about().events.to_vec();
    }
    if let Some(path) = &args.knobs {
        let turned = read_knobs(program, &config, path)?;
        config.knobs.extend(turned);
        config.knobs.sort_by_key(|timed| timed.at);
    }
    let mut whole = program.system.about().setup();
    whole.extend(config.setup.iter().cloned());
    let warnings = program.system.warnings(&whole);
    let overloads = program.system.overloads(&whole);
    for warning in warnings.iter().chain(&overloads).chain(&ignored(&config)) {
        note(warning);
    }
    Ok((config, like))
}

/// Returns a note about given knobs that have no effect under the clock of the run, if any.
fn ignored(config: &Config) -> Option<String> {
    let timed = config.knobs.iter().map(|timed| &timed.knob);
    let ignored: Vec<String> = config
        .setup
        .iter()
        .chain(timed)
        .filter(|knob| knob.kind().sets(TickTiming::Start))
        .map(Knob::to_string)
        .collect();
    (config.clock == ClockKind::Real && !ignored.is_empty()).then(|| {
        let knobs = ignored.join(", ");
        format!("without effect: {knobs}: the real clock has a lateness of its own")
    })
}

/// Returns the knobs in the options, each with a prefix for its errors; later ones have precedence.
fn settings(program: &Program, args: &GraphArgs) -> Result<Vec<(String, Vec<Knob>)>, Error> {
    let aliases = args
        .system
        .given
        .iter()
        .map(|(name, knobs)| Ok((format!("--{name} "), knobs.clone())));
    let broken = program
        .system
        .knobs()
        .broken()
        .filter(|_| args.system.broken)
        .map(|knob| read_knob(program, "--break", knob));
    let knobs = args
        .knob
        .iter()
        .map(|knob| read_knob(program, "--knob", knob));
    let timing = timing(&args.timing).map(Ok);
    aliases.chain(broken).chain(timing).chain(knobs).collect()
}

/// Returns the world in the options, or else the `usual` one.
///
/// # Errors
/// [`Error::BadInput`] for an invalid step.
pub fn world(args: &TimingArgs, usual: WorldKind) -> Result<WorldKind, Error> {
    let name = match args.world {
        None if args.world_step_ms.is_none() => return Ok(usual),
        None => usual.name(),
        Some(WorldArg::Course) => "course",
        Some(WorldArg::Own) => "own",
    };
    let world = WorldKind::parse(name, args.world_step_ms);
    world.map_err(|why| Error::BadInput(format!("--world-step-ms: {why}")))
}

/// Returns the knobs with options of their own, each with a prefix for its errors.
pub fn timing(args: &TimingArgs) -> impl Iterator<Item = (String, Vec<Knob>)> + use<'_> {
    args.takes
        .iter()
        .chain(&args.offset)
        .map(|knob| (format!("--{}: ", knob.kind().name()), vec![knob.clone()]))
}

/// Parses the knobs in `text`; their errors begin with the given prefix.
///
/// # Errors
/// [`Error::BadInput`] for an invalid knob.
pub fn read_knob(
    program: &Program,
    option: &str,
    text: &str,
) -> Result<(String, Vec<Knob>), Error> {
    let prefix = format!("{option} {text:?}: ");
    match program.knobs().parse(text) {
        Ok(knobs) => Ok((prefix, knobs)),
        Err(error) => Err(Error::BadInput(format!("{prefix}{error}"))),
    }
}

/// Builds the setup from `settings`, each with a prefix for its errors; later settings
/// have precedence.
///
/// # Errors
/// [`Error::BadInput`] if a node would refuse its message.
pub fn setup(
    program: &Program,
    seed: u64,
    settings: Vec<(String, Vec<Knob>)>,
) -> Result<Setup, Error> {
    let knobs = settings.iter().flat_map(|(_, knobs)| knobs.iter().cloned());
    let given: Setup = knobs.collect();
    let mut setup = Setup::default();
    for (prefix, knobs) in settings {
        for knob in knobs {
            let resolved = resolved(program, seed, &given, knob);
            setup.set(resolved.map_err(|why| Error::BadInput(format!("{prefix}{why}")))?);
        }
    }
    Ok(setup)
}

/// Returns `knob` in recordable form, with its durations loaded.
///
/// # Errors
/// The reason why the node would refuse it.
pub fn resolved(program: &Program, seed: u64, setup: &Setup, knob: Knob) -> Result<Knob, String> {
    with_durations(program.system.resolved(seed, setup, knob)?)
}

/// Refuses options without effect on the chosen clock.
fn check_clock(args: &GraphArgs, clock: ClockKind) -> Result<(), Error> {
    let why = match clock {
        ClockKind::Real if args.like.is_some() => {
            "--like runs in virtual time what was recorded: leave --clock real out"
        }
        ClockKind::Virtual if args.realtime => {
            "--realtime has no meaning on the virtual clock: add --clock real"
        }
        ClockKind::Real if args.speed.is_some() => {
            "--speed sets the pace of virtual time: add --clock virtual"
        }
        _ => return Ok(()),
    };
    Err(Error::BadInput(why.to_owned()))
}

fn read_knobs(program: &Program, config: &Config, path: &Path) -> Result<Vec<TimedKnob>, Error> {
    let refused =
        |why: &dyn fmt::Display| Error::BadInput(format!("--knobs {}: {why}", path.display()));
    let text = file::read_text(path, MAX_KNOBS).map_err(|why| refused(&why))?;
    let lines = program
        .knobs()
        .parse_lines(&text)
        .map_err(|error| refused(&error))?
        .into_iter();
    // Whatever is wrong with the options is found where the run is built.
    let graph = Experiment::new(program.system.clone(), config).ok();
    let knobs = lines.map(|(line, TimedKnob { at, knob })| {
        let knob = resolved(program, config.seed, &config.setup, knob)
            .and_then(|knob| {
                let known = graph.as_ref().map_or(Ok(()), |graph| graph.check(&knob));
                known.map(|()| knob).map_err(|why| why.to_string())
            })
            .map_err(|why| refused(&format_args!("line {line}: {why}")))?;
        Ok(TimedKnob { at, knob })
    });
    knobs.collect()
}

/// Requests real-time priority if the options ask for it; returns the result.
pub fn realtime(args: &GraphArgs) -> Option<Result<RealtimePriority, RealtimeError>> {
    let asked = args.realtime.then(RealtimePriority::request)?;
    Some(asked.inspect_err(|refusal| note(&format!("--realtime: {refusal}"))))
}
