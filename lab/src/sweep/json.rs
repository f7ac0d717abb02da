//! The result of a sweep for programs.

use ratelab_experiment::sweep::{Cell, CellResult, Sweep, Swept};
use ratelab_system::names::key;
use serde_json::{Map, Value, json};

use super::{
    by_age::AgeTable,
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
    let mut whole = object(json!({
        "cells": cells.collect::<Vec<_>>(),
        "complete": swept.is_complete(),
        "duration_s": rounded(summary.sweep.base.end.as_secs_f64()),
        "runs": summary.runs,
        "runs_asked_for": summary.cells,
        "survival": rows.collect::<Vec<_>>(),
        "version": env!("CARGO_PKG_VERSION"),
    }));
    if let Some(cost) = summary.sweep.system.judge().quadratic_cost() {
        whole.insert("quadratic_cost_is_the_mean_of".to_owned(), json!(cost.sum));
    }
    if let Some(by_age) = by_age {
        whole.insert("by_age".to_owned(), by_age.json());
    }
    format!("{:#}", Value::Object(whole))
}

fn survival(summary: &SweepSummary, row: &RowSummary) -> Value {
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
    Value::Object(figures)
}

/// Returns a run of the sweep. Its keys match the keys of a run's metrics.
fn run(summary: &SweepSummary, topics: &[String], cell: &Cell, outcome: &CellResult) -> Value {
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
    Value::Object(figures)
}

fn conditions(sweep: &Sweep, cell: &Cell) -> Map<String, Value> {
    let values = knob_columns(sweep).into_iter().map(|column| {
        let value = value(column.kind, &column.short(sweep, cell));
        (key(&column.name), value)
    });
    values.collect()
}
