//! The input files, output files and printed results of a run.

use std::path::PathBuf;

use ratelab::Knob;
use ratelab_experiment::{Experiment, Summary, header};
use ratelab_real_clock::{RealtimeError, RealtimePriority};
use ratelab_recording::{Destination, FinishedRecording, Recorder, RrdFormat, Source, Viewer};
use ratelab_system::System;
use serde_json::json;

use crate::{
    cli::RunArgs,
    error::Error,
    like::{self, Like},
    output::{OutputPlan, Outputs, note, print_data, print_line, print_recorded, record_error},
    program::{self, Program},
    signals,
    summary::{
        json,
        text::{self, ReportContext},
    },
};

/// Name of the file in `--out`.
const METRICS: &str = "metrics.json";

/// Returns the files to write according to `args`, and the files that `experiment` reads.
///
/// # Errors
/// [`Error::BadInput`] if rows are requested and the system has no states.
pub fn plan<'a>(args: &'a RunArgs, experiment: &Experiment) -> Result<OutputPlan<'a>, Error> {
    let config = experiment.config();
    let timed = config.knobs.iter().map(|timed| &timed.knob);
    let mut inputs = input_files(&**experiment.system(), config.setup.iter().chain(timed));
    let knobs = args.graph.knobs.clone();
    inputs.extend(knobs.map(|path| ("--knobs".to_owned(), path)));
    let like = args.graph.like.clone();
    inputs.extend(like.map(|path| ("--like".to_owned(), path)));
    let header = header(experiment);
    if let (Some(path), None) = (&args.csv, &header) {
        let name = experiment.system().name();
        return Err(Error::BadInput(format!(
            "--csv {}: {name} has no topic of states to make rows of: try --record",
            path.display()
        )));
    }
    Ok(OutputPlan {
        out: args.out.as_deref(),
        metrics: METRICS,
        csv: args.csv.as_deref(),
        svg: None,
        header: header.unwrap_or_default(),
        record: args.record.as_ref().and_then(Option::as_deref),
        inputs,
    })
}

/// Returns the destination of recordings according to `args`, if any. If the viewer of
/// `--rerun` is missing, prints a note and goes on without it.
pub fn destination(args: &RunArgs) -> Option<Destination> {
    let viewer = args.rerun.as_deref().map(Viewer::find);
    if let Some(Err(why)) = &viewer {
        note(&format!("--rerun: {why}; the run goes on without"));
    }
    let found = viewer.and_then(Result::ok);
    let asked = args.record.is_some() || found.is_some();
    let place = args.record.clone().flatten();
    asked.then(|| destination_of(place, found))
}

/// Returns recordings at `place` or in the default folder, and in a `viewer` if any. After a
/// signal they end soon.
pub fn destination_of(place: Option<PathBuf>, viewer: Option<Viewer>) -> Destination {
    let is_overdue = signals::is_overdue;
    Destination::new(place, RrdFormat { viewer, is_overdue })
}

/// Starts a recording of `experiment`.
///
/// # Errors
/// [`Error`] if the file cannot be created.
pub fn record(mut destination: Destination, experiment: &Experiment) -> Result<Recorder, Error> {
    let source = Source {
        notice: note,
        ..Source::for_experiment(experiment)
    };
    Recorder::from_the_start(&mut destination, &source).map_err(record_error)
}

/// Returns the topics of `experiment` with readers, in the order of a summary.
pub fn read_topics(experiment: &Experiment) -> Vec<String> {
    let topics = experiment.observer().snapshot().topics;
    topics
        .iter()
        .filter(|topic| topic.is_read())
        .map(|topic| topic.name.to_string())
        .collect()
}

/// Returns the files named by `knobs`, by option.
pub fn input_files<'k>(
    system: &dyn System,
    knobs: impl Iterator<Item = &'k Knob>,
) -> Vec<(String, PathBuf)> {
    let files = knobs.filter_map(|knob| {
        let Knob::Send { node, text } = knob else {
            return None;
        };
        let alias = system
            .knobs()
            .aliases()
            .iter()
            .find(|alias| alias.knobs == [(knob.kind(), node.as_str())]);
        Some((
            format!("--{}", alias.map_or("knob", |alias| alias.name)),
            system.knobs().file(node, text)?,
        ))
    });
    files.collect()
}

/// Returns what is to be printed of a run that was asked for by `args`.
pub fn context(
    args: &RunArgs,
    realtime: Option<Result<RealtimePriority, RealtimeError>>,
    csv_lost: u64,
) -> ReportContext {
    ReportContext {
        break_bug: args.graph.system.broken,
        smoke: args.smoke,
        realtime: realtime.map(|asked| asked.map(drop)),
        csv_lost,
        ..ReportContext::default()
    }
}

/// Prints the paths of recordings made by a dashboard, and why `verify` will refuse one: the
/// dashboard has shown that only for a moment.
pub fn print_recordings(json: bool, recorded: &[FinishedRecording]) -> Result<(), Error> {
    for recorded in recorded {
        if let Some(defect) = recorded.defect() {
            note(&defect);
        }
        print_recorded(json, recorded)?;
    }
    Ok(())
}

/// Writes and prints the results of a run, beside the results of the recorded run that it
/// is `like`.
pub fn print_results(
    program: &Program,
    args: &RunArgs,
    outputs: Outputs,
    summary: &Summary,
    context: &ReportContext,
    like: Option<&Like>,
) -> Result<(), Error> {
    let system = &*program.system;
    let mut metrics = json::metrics(system, summary, context);
    if let Some(like) = like {
        let comparison = json!(like::LikeReport::new(like, summary));
        metrics.insert("like".to_owned(), comparison);
    }
    let metrics = json::text(metrics);
    outputs.write(&metrics)?;
    if args.json {
        return print_data(&metrics);
    }
    if context.covered {
        let name = program::name();
        return print_line(&format!(
            "The summary would name the cause. Answer first: {name} exercise 10"
        ));
    }
    print_line(&text::render(system, summary, context))?;
    let table = like.map(|of| like::text(system, of, summary));
    table.map_or(Ok(()), |table| print_line(&table))
}
