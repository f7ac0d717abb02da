//! The files that a run's command reads and writes, and what it prints.

use std::path::Path;

use ratelab::{
    experiment::{Config, Summary},
    policy::PolicySpec,
    runtime::clock::RealtimePriority,
};

use crate::{
    cli::RunArgs,
    csv,
    error::Error,
    metrics,
    output::{OutputPlan, Outputs, print_line},
    report::{self, ReportContext},
};

/// Name of the file in `--out`.
const METRICS: &str = "metrics.json";

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
