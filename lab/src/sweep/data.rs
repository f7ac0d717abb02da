//! The result of a sweep for programs, as JSON and as a CSV file.

use std::io::{self, BufWriter, Write};

use ratelab_experiment::{
    Experiment,
    sweep::{Cell, CellResult, Sweep, Swept},
};
use ratelab_recording::printable::row_of;
use ratelab_system::names::{good, key};
use serde::Serialize;
use serde_json::{Map, Value, json};

use super::{
    cliff::{AgeTable, AgeTableFigures},
    columns::{knob_columns, part_columns},
    summary::{self, RowSummary, SweepSummary},
};
use crate::{
    error::Error,
    results::read_topics,
    summary::{
        Digits,
        json::{finals, object, result, value},
        rounded,
    },
};

/// Returns the sweep as JSON: how often the runs were not lost, then every run. It holds nothing of
/// the wall's, so the same sweep gives the same bytes.
pub fn json_text(
    summary: &SweepSummary,
    swept: &Swept,
    topics: &[String],
    by_age: Option<&AgeTable>,
) -> String {
    let rows = summary.rows().iter().map(|row| survival(summary, row));
    let cells = swept
        .finished()
        .map(|(cell, outcome)| run(summary, topics, &cell, outcome));
    let figures = SweepFigures {
        by_age: by_age.map(AgeTable::figures),
        cells: cells.collect(),
        complete: swept.is_complete(),
        duration_s: rounded(summary.sweep.base.end.as_secs_f64()),
        quadratic_cost_is_the_mean_of: (summary.sweep.system.judge().quadratic_cost())
            .map(|cost| cost.sum),
        runs: summary.runs,
        runs_asked_for: summary.cells,
        survival: rows.collect(),
        version: env!("CARGO_PKG_VERSION"),
    };
    format!("{:#}", Value::Object(object(&figures)))
}

/// A sweep for programs.
#[derive(Serialize)]
struct SweepFigures {
    #[serde(skip_serializing_if = "Option::is_none")]
    by_age: Option<AgeTableFigures>,
    cells: Vec<Map<String, Value>>,
    complete: bool,
    duration_s: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    quadratic_cost_is_the_mean_of: Option<&'static str>,
    runs: usize,
    runs_asked_for: usize,
    survival: Vec<Map<String, Value>>,
    version: &'static str,
}

fn survival(summary: &SweepSummary, row: &RowSummary) -> Map<String, Value> {
    let mut figures = conditions(&summary.sweep, &row.survival.cell);
    figures.extend([
        (key(&summary.good), json!(row.survival.held)),
        ("runs".to_owned(), json!(row.survival.runs)),
        ("share".to_owned(), json!(row.survival.share().map(rounded))),
    ]);
    let known = summary::figures(summary).into_iter();
    figures.extend(known.map(|figure| (figure.key.to_owned(), figure.json(row))));
    if summary.theory {
        let sure = json!(row.theory.sure);
        figures.insert("shrinks_whatever_the_pattern".to_owned(), sure);
    }
    figures
}

/// Returns a run of the sweep. Its keys match the keys of a run's metrics.
fn run(
    summary: &SweepSummary,
    topics: &[String],
    cell: &Cell,
    outcome: &CellResult,
) -> Map<String, Value> {
    let mut figures = conditions(&summary.sweep, cell);
    figures.insert(key(&summary.good), json!(!outcome.is_lost()));
    figures.insert("seed".to_owned(), json!(cell.seed));
    figures.extend(result(Digits::Four, outcome));
    let dropped = topics.iter().zip(&outcome.dropped);
    figures.extend(dropped.map(|(topic, dropped)| {
        let name = format!("{}_dropped", key(topic));
        (name, json!(dropped))
    }));
    let system = &*summary.sweep.system;
    figures.extend(finals(
        Digits::Four,
        system,
        outcome.sim_time,
        &outcome.state,
    ));
    figures
}

fn conditions(sweep: &Sweep, cell: &Cell) -> Map<String, Value> {
    let values = knob_columns(sweep).into_iter().map(|column| {
        let value = value(column.kind, &column.short(sweep, cell));
        (key(&column.name), value)
    });
    values.collect()
}

/// Returns the names of the topics with readers, in the order of a summary.
///
/// # Errors
/// [`Error::Build`] if the graph cannot be built.
pub fn topics(sweep: &Sweep) -> Result<Vec<String>, Error> {
    let first = sweep.cell(0).map(|cell| sweep.config(&cell));
    let config = first.as_ref().unwrap_or(&sweep.base);
    Ok(read_topics(&Experiment::new(sweep.system.clone(), config)?))
}

/// The figures that every run has, behind its knobs.
const FIGURES: &str = "seed,cause_of_end,steps,sim_time_s,mean_latency_s";

/// How old what was done to the world was: on average over the run, and over its last
/// second.
const AGES: &str = "mean_push_age_s,late_push_age_s";

/// The ages once more, in the unit of all ages and their parts, behind all other columns. The columns in
/// seconds go with a later version.
const IN_MS: [&str; 3] = ["mean_latency_ms", "mean_push_age_ms", "late_push_age_ms"];

/// Returns the names and units of the first columns, by which a file is known as a table of this sweep.
pub fn header(sweep: &Sweep, topics: &[String]) -> String {
    let knobs = knob_columns(sweep).into_iter();
    let dropped = topics.iter().map(|topic| format!("{}_dropped", key(topic)));
    let finals = sweep
        .system
        .judge()
        .finals(&[])
        .into_iter()
        .map(|figure| key(&format!("{} {}", figure.name, figure.unit)));
    let cost = sweep
        .system
        .judge()
        .quadratic_cost()
        .map(|_| "quadratic_cost");
    let columns = knobs
        .map(|column| key(&column.name))
        .chain([FIGURES.to_owned()])
        .chain(dropped)
        .chain(finals)
        .chain([AGES].into_iter().chain(cost).map(str::to_owned));
    columns.collect::<Vec<_>>().join(",")
}

/// Writes the finished runs below `header`, in the order of the sweep.
pub fn write(file: impl Write, header: &str, swept: &Swept) -> io::Result<()> {
    let (mut out, sweep) = (BufWriter::new(file), swept.sweep());
    let parts = part_columns(swept.finished().map(|(_, outcome)| outcome));
    let names = parts.iter().map(|part| format!(",{}", key(&part.name())));
    let good = key(&good(&*sweep.system));
    let last = IN_MS
        .into_iter()
        .chain([&*good])
        .map(|name| format!(",{name}"));
    writeln!(out, "{header}{}", names.chain(last).collect::<String>())?;
    let (knobs, system) = (knob_columns(sweep), &*sweep.system);
    for (cell, outcome) in swept.finished() {
        let mut row: Vec<String> = knobs.iter().map(|knob| knob.value(sweep, &cell)).collect();
        row.extend([
            cell.seed.to_string(),
            outcome.verdict.name().to_owned(),
            outcome.steps.to_string(),
            outcome.sim_time.as_secs_f64().to_string(),
            known(outcome.mean_latency_s),
        ]);
        row.extend(outcome.dropped.iter().map(ToString::to_string));
        let finals = system.judge().finals_at(outcome.sim_time, &outcome.state);
        row.extend(finals.iter().map(|figure| figure.value.to_string()));
        let age = outcome.push_age;
        row.extend([age.map(|age| age.run_s), age.map(|age| age.late_s)].map(known));
        row.extend(system.judge().quadratic_cost().map(|_| known(outcome.cost)));
        row.extend(parts.iter().map(|part| known(part.value(outcome))));
        let ages = [
            outcome.mean_latency_s,
            age.map(|age| age.run_s),
            age.map(|age| age.late_s),
        ];
        row.extend(ages.map(|seconds| known(seconds.map(|seconds| seconds * 1e3))));
        row.push((!outcome.is_lost()).to_string());
        writeln!(out, "{}", row_of(row))?;
    }
    out.flush()
}

/// Returns a figure; empty if it is unknown.
fn known(figure: Option<f64>) -> String {
    figure.map_or_else(String::new, |figure| figure.to_string())
}
