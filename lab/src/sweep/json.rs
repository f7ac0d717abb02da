//! The result of a sweep for programs.

use ratelab_experiment::sweep::{Cell, CellResult, Sweep, Swept};
use ratelab_system::names::key;
use serde::Serialize;
use serde_json::{Map, Value, json};

use super::{
    by_age::{AgeTable, AgeTableFigures},
    columns::knob_columns,
    summary::{self, RowSummary, SweepSummary},
};
use crate::summary::{
    Digits,
    json::{finals, object, result, value},
    rounded,
};

/// Returns the sweep as JSON: how often the runs were not lost, then every run. It holds nothing of
/// the wall's, so the same sweep gives the same bytes.
pub fn text(
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
