//! The input files, output files and printed results of a run.

use std::path::PathBuf;

use ratelab::{
    experiment::{Experiment, Summary},
    runtime::{Knob, clock::RealtimePriority},
    system::System,
};

use crate::{
    cli::RunArgs,
    csv,
    error::Error,
    metrics,
    output::{OutputPlan, Outputs, print_line},
    program::Program,
    report::{self, ReportContext},
};

/// Name of the file in `--out`.
const METRICS: &str = "metrics.json";

/// The files to write according to `args`, and the files that `experiment` reads.
///
/// # Errors
/// [`Error::BadInput`] if rows are requested and the system has no states.
pub fn plan<'a>(args: &'a RunArgs, experiment: &Experiment) -> Result<OutputPlan<'a>, Error> {
    let config = experiment.config();
    let timed = config.knobs.iter().map(|timed| &timed.knob);
    let mut inputs = input_files(&**experiment.system(), config.setup.iter().chain(timed));
    let knobs = args.graph.knobs.clone();
    inputs.extend(knobs.map(|path| ("--knobs".to_owned(), path)));
    let header = csv::header(experiment);
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
        header: header.unwrap_or_default(),
        record: args.record.as_ref().and_then(Option::as_deref),
        inputs,
    })
}

/// The files named by `knobs`, by option.
pub fn input_files<'k>(
    system: &dyn System,
    knobs: impl Iterator<Item = &'k Knob>,
) -> Vec<(String, PathBuf)> {
    let files = knobs.filter_map(|knob| {
        let Knob::Send { node, text } = knob else {
            return None;
        };
        let mut aliases = system.aliases().iter();
        let alias = aliases.find(|alias| alias.knobs == [(knob.kind(), node.as_str())]);
        Some((
            format!("--{}", alias.map_or("knob", |alias| alias.name)),
            system.file(node, text)?,
        ))
    });
    files.collect()
}

/// Writes and prints the results of a run.
pub fn print_results(
    program: &Program,
    args: &RunArgs,
    outputs: Outputs,
    summary: &Summary,
    realtime: Option<Result<RealtimePriority, String>>,
    csv_lost: u64,
) -> Result<(), Error> {
    let context = ReportContext {
        break_bug: args.graph.system.broken,
        smoke: args.smoke,
        realtime: realtime.map(|asked| asked.map(drop)),
        csv_lost,
        open: None,
    };
    let metrics = metrics::json(&*program.system, summary, &context);
    outputs.write(&metrics)?;
    if args.json {
        print_line(&metrics)
    } else {
        print_line(&report::text(&*program.system, summary, &context))
    }
}
