//! Runs like a recorded one, or on another runtime, and the comparison of both.

use std::{
    collections::BTreeMap,
    iter,
    ops::ControlFlow,
    path::{Path, PathBuf},
    sync::Arc,
    time::Duration,
};

use ratelab::{ClockKind, Command, Event, Knob, KnobKind, TickTiming, Time, TimedKnob};
use ratelab_experiment::{Config, Experiment, Summary, Table};
use ratelab_metrics::Distribution;
use ratelab_recording::{
    OtherRun, Recording, Replay, RunStatus, VerifyWith, durations, printable::shown, verify,
};
use ratelab_screen::{Options, SessionSetup};
use ratelab_system::{System, measured::loaded};
use serde::Serialize;
use thiserror::Error as ThisError;

use crate::{
    error::Error,
    output::print_line,
    program::Program,
    reading,
    screen::{quit_on_signal, theme},
    summary::{
        json, rounded,
        text::{line, ms, ms_or_dash, overruns},
    },
};

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

/// The compared quantiles.
const QUANTILES: [(&str, f64); 4] = [("p10", 0.1), ("p50", 0.5), ("p90", 0.9), ("p99", 0.99)];

/// Returns the table, with one line per figure.
pub fn text(system: &dyn System, like: &Like, model: &Summary) -> String {
    let table = Table {
        headers: ["", "recorded", "virtual"].map(str::to_owned).to_vec(),
        rows: rows(system, [&like.recorded, model]),
        named: true,
    };
    ["like"]
        .into_iter()
        .chain(iter::repeat(""))
        .zip(table.lines())
        .map(|(title, text)| line(title, &text))
        .collect::<Vec<_>>()
        .join("\n")
}

fn rows(system: &dyn System, runs: [&Summary; 2]) -> Vec<Vec<String>> {
    let row = |name: String, cell: &dyn Fn(&Summary) -> String| {
        let [recorded, model] = runs.map(cell);
        vec![name, recorded, model]
    };
    let mut rows = vec![row("verdict".to_owned(), &|run| {
        format!("{} {}", run.verdict.name(), run.sim_time)
    })];
    let [recorded, model] = runs.map(|run| {
        system
            .latency()
            .map(|(_, meter)| (meter, &run.latency))
            .into_iter()
            .chain(run.chain_latencies(system))
    });
    for ((meter, recorded), (_, model)) in recorded.zip(model) {
        let of = |name: &str, cell: &dyn Fn(&Distribution) -> Option<Duration>| {
            let [recorded, model] = [recorded, model].map(|latency| ms_or_dash(cell(latency)));
            vec![format!("{meter} {name}"), recorded, model]
        };
        for (name, quantile) in QUANTILES {
            rows.push(of(name, &|latency| latency.quantile(quantile)));
        }
        rows.push(of("max", &Distribution::max));
    }
    if runs.iter().any(|run| run.push_age().is_some()) {
        rows.push(row("push age mean".to_owned(), &|run| {
            run.push_age().map_or("-".to_owned(), |age| ms(age.run_s))
        }));
    }
    let nodes = runs[1].nodes.iter().map(|node| &node.name);
    rows.extend(nodes.map(|name| {
        row(format!("overruns {name}"), &|run| {
            run.node(name).map_or("-".to_owned(), overruns)
        })
    }));
    rows
}

/// The comparison of both runs, for programs.
#[derive(Serialize)]
pub struct LikeReport {
    file: String,
    recorded: RunFigures,
    #[serde(rename = "virtual")]
    model: RunFigures,
}

#[derive(Serialize)]
struct RunFigures {
    cause_of_end: String,
    latency: LatencyFigures,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    latencies: BTreeMap<String, LatencyFigures>,
    mean_push_age_ms: Option<f64>,
    overruns: BTreeMap<String, u64>,
    sim_time_s: f64,
}

#[derive(Serialize)]
struct LatencyFigures {
    count: u64,
    max_ms: Option<f64>,
    p10_ms: Option<f64>,
    p50_ms: Option<f64>,
    p90_ms: Option<f64>,
    p99_ms: Option<f64>,
}

impl LikeReport {
    /// Compares the recorded run with its `model`.
    pub fn new(like: &Like, model: &Summary) -> Self {
        Self {
            file: like.file.display().to_string(),
            recorded: RunFigures::new(&like.recorded),
            model: RunFigures::new(model),
        }
    }
}

impl RunFigures {
    fn new(run: &Summary) -> Self {
        let overruns = run
            .nodes
            .iter()
            .map(|node| (node.name.to_string(), node.overruns));
        let latencies = run.latencies.iter();
        Self {
            cause_of_end: run.verdict.name().to_owned(),
            latency: LatencyFigures::new(&run.latency),
            latencies: latencies
                .map(|(chain, of)| (chain.to_string(), LatencyFigures::new(of)))
                .collect(),
            mean_push_age_ms: run.push_age().map(|age| json::ms(age.run_s)),
            overruns: overruns.collect(),
            sim_time_s: rounded(run.sim_time.as_secs_f64()),
        }
    }
}

impl LatencyFigures {
    fn new(latency: &Distribution) -> Self {
        let [p10_ms, p50_ms, p90_ms, p99_ms] =
            QUANTILES.map(|(_, quantile)| json::duration_ms(latency.quantile(quantile)));
        Self {
            count: latency.count(),
            max_ms: json::duration_ms(latency.max()),
            p10_ms,
            p50_ms,
            p90_ms,
            p99_ms,
        }
    }
}

/// Maximum frames per second.
const FPS: u32 = 30;

/// Plays `run` in the dashboard if there is a terminal; then compares every message and tick
/// with the run on our runtime, and prints the result.
pub fn show(system: &Arc<dyn System>, run: OtherRun) -> Result<(), Error> {
    let recording = Arc::new(Recording::from_other_runtime(run, system)?);
    if ratelab_screen::terminal_is_there() {
        let options = Options {
            fps: FPS,
            theme: theme(false, None),
            ask_background: false,
            quit_on_signal,
        };
        let setup = SessionSetup::new(system.clone(), None);
        ratelab_screen::play(recording.clone(), setup, &options)?;
    }
    let name = shown(&recording.path);
    let identical = verify(&recording, system, VerifyWith::default(), |_| {
        ControlFlow::Continue(())
    })
    .map_err(|why| Error::unverified(&name, why))?;
    print_line(&format!("{name}: {identical}"))
}
