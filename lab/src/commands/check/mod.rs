//! `ratelab check`: whether the runs of a graph keep its limits, for tests.

use std::{collections::BTreeMap, ops::ControlFlow};

use ratelab::Time;
use ratelab_experiment::{Config, Experiment, Summary, parallel::in_parallel, sweep::all_cores};
use ratelab_screen::escaped;
use ratelab_system::{FigureLimit, System, Verdict};
use serde::Serialize;
use serde_json::{Map, Value};

use crate::{
    cli::CheckArgs,
    error::Error,
    options::{self, Defaults},
    output::{OutputKind, ProgressLine, print_result},
    program::Program,
    signals,
    summary::{json, text::lines},
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
    print_result(args.json, &results, &results.text(resolved.end))?;
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

/// The figures of a run.
pub struct CheckedRun {
    pub seed: u64,
    pub verdict: Verdict,
    pub metrics: Map<String, Value>,
    /// The chains without data, each with the reason.
    pub without_data: Vec<String>,
}

impl CheckedRun {
    /// Returns why its verdict counts as a missed limit, if it does: it is lost, or a chain has no
    /// data.
    fn miss(&self) -> Option<Miss> {
        let reasons: Vec<String> = self
            .verdict
            .is_lost()
            .then(|| self.verdict.to_string())
            .into_iter()
            .chain(self.without_data.iter().cloned())
            .collect();
        (!reasons.is_empty()).then(|| Miss {
            seed: self.seed,
            text: reasons.join("; "),
        })
    }
}

/// Compares the limits of the graph of `program` with its `runs`; the verdict is a limit as well,
/// and with it that data come through each chain.
///
/// # Errors
/// [`Error::BadInput`] for a limit of a figure that the runs do not have.
pub fn compare(program: &Program, runs: &[CheckedRun]) -> Result<Results, Error> {
    let verdict = LimitResult {
        limit: "verdict".to_owned(),
        misses: runs.iter().filter_map(CheckedRun::miss).collect(),
    };
    let limits = program
        .system
        .about()
        .limits
        .iter()
        .map(|limit| compared(program, limit, runs));
    let limits = [Ok(verdict)].into_iter().chain(limits);
    let limits = limits.collect::<Result<Vec<LimitResult>, _>>()?;
    Ok(Results {
        graph: program.system.name().to_owned(),
        kept: limits.iter().all(|limit| limit.misses.is_empty()),
        runs: runs.len(),
        limits,
    })
}

/// Returns one limit, and the runs that miss it. What was not measured is missed.
fn compared(
    program: &Program,
    limit: &FigureLimit,
    runs: &[CheckedRun],
) -> Result<LimitResult, Error> {
    let mut misses = Vec::new();
    for run in runs {
        let text = match figure(&run.metrics, &limit.figure) {
            Some(Value::Number(number)) => {
                let kept = number
                    .as_f64()
                    .is_some_and(|value| limit.bound.holds(value));
                (!kept).then(|| number.to_string())
            }
            Some(Value::Null) => Some("not measured".to_owned()),
            _ => {
                let (figure, [line, column]) = (&limit.figure, limit.place);
                let file = program.file.iter();
                let place: String = file
                    .map(|file| format!("{file}:{line}:{column}: "))
                    .collect();
                let text = format!(
                    "{place}limit {figure:?}: no figure of a run: expected a number that run --json prints, such as nodes.NODE.overruns"
                );
                return Err(Error::BadInput(text));
            }
        };
        misses.extend(text.map(|text| Miss {
            seed: run.seed,
            text,
        }));
    }
    Ok(LimitResult {
        limit: limit.to_string(),
        misses,
    })
}

/// Returns the figure at `path` within `metrics`: names with dots between, and within some names.
fn figure<'m>(metrics: &'m Map<String, Value>, path: &str) -> Option<&'m Value> {
    metrics.iter().find_map(|(name, value)| {
        let rest = path.strip_prefix(name.as_str())?;
        match value {
            _ if rest.is_empty() => Some(value),
            Value::Object(inner) => figure(inner, rest.strip_prefix('.')?),
            _ => None,
        }
    })
}

/// What the runs of a graph make of its limits.
#[derive(Serialize)]
pub struct Results {
    pub graph: String,
    /// Whether no run misses a limit.
    pub kept: bool,
    /// Number of runs.
    pub runs: usize,
    pub limits: Vec<LimitResult>,
}

/// A limit, and the runs that miss it.
#[derive(Serialize)]
pub struct LimitResult {
    pub limit: String,
    #[serde(rename = "missed")]
    pub misses: Vec<Miss>,
}

/// A run that misses a limit.
#[derive(Serialize)]
pub struct Miss {
    pub seed: u64,
    /// Its figure, or its verdict.
    #[serde(rename = "found")]
    pub text: String,
}

impl LimitResult {
    /// Returns what was missed, of so many `runs`.
    fn miss(&self, runs: usize) -> Option<String> {
        let first = self.misses.first()?;
        let others = match (self.misses.len(), runs) {
            (1, 1) => String::new(),
            (missed, _) => format!(" ({missed} of {runs} runs)"),
        };
        Some(format!("{} with seed {}{others}", first.text, first.seed))
    }
}

impl Results {
    fn missed(&self) -> impl Iterator<Item = (&LimitResult, String)> {
        self.limits
            .iter()
            .filter_map(|limit| Some((limit, limit.miss(self.runs)?)))
    }

    /// Returns a line for each missed limit, and one for the others; the runs were to last to
    /// `end`.
    pub fn text(&self, end: Time) -> String {
        let missed = self
            .missed()
            .map(|(limit, miss)| ("missed", format!("{}: {miss}", limit.limit)));
        let mut rows: Vec<_> = missed.collect();
        let (all, runs, end) = (self.limits.len(), self.runs, end.as_secs_f64());
        let kept = all - rows.len();
        let runs = match runs {
            1 => "1 run".to_owned(),
            runs => format!("{runs} runs"),
        };
        let text = format!("{kept} of {all} limits, in {runs} of {end} s");
        rows.push(("kept", text));
        lines(&rows)
    }

    /// Returns a test for each limit, as JUnit XML.
    pub fn junit(&self) -> String {
        let (graph, failures) = (escaped(&self.graph), self.missed().count());
        let tests = self.limits.iter().map(|limit| {
            let name = escaped(&limit.limit);
            let failure = limit.miss(self.runs).map_or_else(String::new, |miss| {
                format!("<failure message=\"{}\"/>", escaped(&miss))
            });
            format!("  <testcase classname=\"{graph}\" name=\"{name}\">{failure}</testcase>\n")
        });
        format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuite name=\"{graph}\" tests=\"{}\" \
             failures=\"{failures}\">\n{}</testsuite>\n",
            self.limits.len(),
            tests.collect::<String>(),
        )
    }

    /// # Errors
    /// [`Error::Unfinished`] if a limit is missed.
    pub fn outcome(&self) -> Result<(), Error> {
        match self.missed().count() {
            0 => Ok(()),
            missed => {
                let (graph, all) = (&self.graph, self.limits.len());
                Err(Error::Unfinished(format!(
                    "{graph} misses {missed} of {all} limits"
                )))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_figure_is_found_by_its_names_with_dots_between_and_within() {
        let json = json!({ "a": 1, "nodes": { "x": { "n": 2 }, "x.y": { "n": 3 } } });
        let metrics = json.as_object().expect("an object");
        let of = |path| figure(metrics, path).and_then(Value::as_u64);
        assert_eq!(of("a"), Some(1));
        assert_eq!(of("nodes.x.n"), Some(2));
        assert_eq!(of("nodes.x.y.n"), Some(3));
        assert_eq!([of("nodes.x.m"), of("nodes"), of("a.n"), of("")], [None; 4]);
    }
}
