//! `ratelab check`: whether the runs of a graph keep its limits, for tests.

mod limits;
mod results;

use std::{collections::BTreeMap, ops::ControlFlow};

use ratelab_experiment::{Config, Experiment, Summary, parallel::in_parallel, sweep::all_cores};
use ratelab_system::System;

use self::limits::{CheckedRun, compare};
use crate::{
    cli::CheckArgs,
    error::Error,
    options::{self, Defaults},
    output::{OutputKind, ProgressLine, print_result},
    program::Program,
    signals,
    summary::json,
};

/// Defaults of the runs.
const DEFAULTS: Defaults =
    Defaults::virtual_only("a check runs on the virtual clock: leave --clock real out");

/// Runs the graph with each seed, prints each missed limit, and fails if a limit is missed.
/// Ctrl-C keeps the finished runs.
pub fn check(program: &Program, args: &CheckArgs) -> Result<(), Error> {
    let (config, _) = options::graph(program, &args.graph, &DEFAULTS)?;
    let resolved = config.resolved(&*program.system)?;
    let seeds = args
        .seeds
        .as_ref()
        .map(|seeds| seeds.values().to_vec())
        .unwrap_or_else(|| vec![resolved.seed]);
    let junit = args
        .junit
        .as_deref()
        .map(|path| OutputKind::Tests.open("--junit", path))
        .transpose()?;
    let runs = runs(program, args, &resolved, &seeds)?;
    let results = compare(program, &runs)?;
    if let Some(junit) = junit {
        junit.write(results.junit().as_bytes())?;
    }
    print_result(args.json, &results.json(), &results.text(resolved.end))?;
    Error::if_stopped(runs.len(), seeds.len(), "runs")?;
    results.outcome()
}

/// Returns the run with this `seed`, with what its limits are compared with.
fn checked(system: &dyn System, seed: u64, summary: &Summary) -> CheckedRun {
    CheckedRun {
        seed,
        verdict: summary.verdict.clone(),
        without_data: summary.without_data(system),
        metrics: json::measured(system, summary),
    }
}

/// Returns the runs that ended before the first signal, in the order of `seeds`.
fn runs(
    program: &Program,
    args: &CheckArgs,
    config: &Config,
    seeds: &[u64],
) -> Result<Vec<CheckedRun>, Error> {
    let (system, interrupt) = (&program.system, signals::interrupt());
    let bar = ProgressLine::for_runs(seeds.len(), true, args.json);
    let run = |seed: u64| -> Result<Option<CheckedRun>, Error> {
        let mut seeded = config.clone();
        seeded.seed = seed;
        let experiment = Experiment::from_resolved(system.clone(), seeded)?;
        let summary = experiment.run_until(&interrupt)?;
        Ok(summary.map(|summary| checked(&**system, seed, &summary)))
    };
    let (threads, mut runs) = (args.threads.unwrap_or_else(all_cores), BTreeMap::new());
    let work = |index: usize| run(seeds[index]).transpose();
    in_parallel(threads, seeds.len(), work, |index, outcome| {
        bar.advance();
        if outcome.is_err() {
            interrupt.ask();
        }
        runs.insert(index, outcome);
        ControlFlow::Continue(())
    });
    runs.into_values().collect()
}
