//! `ratelab run`: the graph without a dashboard.

use std::path::Path;

use ratelab::{
    experiment::{Config, Experiment, Summary},
    policy::PolicySpec,
    runtime::{ClockKind, Command, RealClock, Speed, Time, clock::RealtimePriority},
};

use crate::{
    cli::RunArgs,
    csv,
    error::Error,
    metrics,
    options::{self, Defaults},
    output::{self, OutputPlan, Outputs, print_line, print_recorded, record_error},
    recording::{Destination, Recorder, Source, StopReason},
    report::{self, ReportContext},
    signals,
};

/// What an ordinary run is.
const DEFAULTS: Defaults = Defaults {
    clock: ClockKind::Real,
    end: Time::from_nanos(10_000_000_000),
    speed: Speed::Unlimited,
};

/// Name of the file in `--out`.
const METRICS: &str = "metrics.json";

/// Runs the graph as asked, prints and writes what it came to.
pub fn run(args: &RunArgs) -> Result<(), Error> {
    let config = options::config(args, &DEFAULTS)?;
    let experiment = Experiment::new(&config)?;
    let commands = experiment.commands();
    // A run that is over is being written down, which the first signal lets be.
    signals::watch(move || drop(commands.send(Command::Stop)), || ());
    let mut outputs = Outputs::prepare(&plan(args, &config))?;
    let recorder = record(args, &experiment, &config)?;
    let realtime = options::realtime(&args.graph);
    let mut csv = outputs.take_csv();
    let rows = csv.as_mut().map(output::CsvFile::begin).transpose()?;
    let rows = rows.map(|file| csv::StepWriter::start(Ok(file), &experiment));
    let mut real = RealClock::new(realtime.clone().and_then(Result::ok));
    let outcome = experiment.run_with(&mut real);
    let recorded = recorder.map(|recorder| {
        recorder.end(StopReason::of(&outcome));
        recorder.finish()
    });
    let written = rows.zip(csv).map(|(rows, csv)| csv.complete(rows.finish()));
    let reported = outcome.map_err(Error::from).and_then(|summary| {
        let csv_lost = written.unwrap_or(Ok(0))?;
        print_results(args, outputs, &summary, realtime, csv_lost)
    });
    let recorded = recorded.map_or(Ok(()), |recorded| print_recorded(args.json, &recorded?));
    both(reported, recorded)
}

/// What `args` ask to be written, and what a run of `config` reads.
pub fn plan<'a>(args: &'a RunArgs, config: &'a Config) -> OutputPlan<'a> {
    let knobs = args.graph.knobs.as_deref();
    let mut inputs = policy_files(config.policies());
    inputs.extend(knobs.map(|path| ("--knobs", path)));
    OutputPlan {
        out: args.out.as_deref(),
        metrics: METRICS,
        csv: args.csv.as_deref(),
        header: csv::HEADER,
        record: args.record.as_ref().and_then(Option::as_deref),
        inputs,
    }
}

/// The files that `policies` come from, as inputs.
pub fn policy_files<'b>(
    policies: impl Iterator<Item = &'b PolicySpec>,
) -> Vec<(&'static str, &'b Path)> {
    let files = policies.filter_map(|policy| match policy {
        PolicySpec::File(file) => Some(("--policy", Path::new(file.path()))),
        PolicySpec::BuiltIn(_) => None,
    });
    files.collect()
}

/// Writes and prints what a run came to.
pub fn print_results(
    args: &RunArgs,
    outputs: Outputs,
    summary: &Summary,
    realtime: Option<Result<RealtimePriority, String>>,
    csv_lost: u64,
) -> Result<(), Error> {
    let context = ReportContext {
        break_bug: args.graph.break_bug,
        smoke: args.smoke,
        realtime: realtime.map(|asked| asked.map(drop)),
        csv_lost,
        open: None,
    };
    let metrics = metrics::json(summary, &context);
    outputs.write(&metrics)?;
    if args.json {
        print_line(&metrics)
    } else {
        print_line(&report::text(summary, &context))
    }
}

/// One of two failures, and the other printed.
fn both(first: Result<(), Error>, second: Result<(), Error>) -> Result<(), Error> {
    if let (Err(error), Err(_)) = (&first, &second) {
        output::error(error);
    }
    second.and(first)
}

/// Begins to record, if that was asked for.
fn record(
    args: &RunArgs,
    experiment: &Experiment,
    config: &Config,
) -> Result<Option<Recorder>, Error> {
    let Some(file) = &args.record else {
        return Ok(None);
    };
    let source = Source::of(experiment, config);
    let begin = |path: &Path| Recorder::from_the_start(path, &source);
    let begun = Destination::new(file.clone()).claim(config, begin);
    let (_, recorder) = begun.map_err(|(path, why)| record_error(&path, &why))?;
    Ok(Some(recorder))
}
