//! The results of a sweep, for programs.

use ratelab_study::{
    experiment::sweep::{Cell, CellResult, Sweep, Swept},
    system::names::key,
};
use serde_json::{Map, Value, json};

use super::{
    by_age::AgeTable,
    columns, figures,
    summary::{RowSummary, SweepSummary},
};
use crate::summary::{
    ages,
    json::{add_figures, object, value},
    rounded,
};

/// The sweep as JSON: how often the runs were not lost, then every run. It holds
/// nothing of the wall's, so the same sweep gives the same bytes.
pub fn text(
    summary: &SweepSummary,
    swept: &Swept,
    topics: &[String],
    by_age: Option<&AgeTable>,
) -> String {
    let rows = summary.rows().iter().map(|row| survival(summary, row));
    let cells = swept.finished();
    let cells = cells.map(|(cell, outcome)| run(summary, topics, &cell, outcome));
    let mut whole = object(json!({
        "cells": cells.collect::<Vec<_>>(),
        "complete": swept.is_complete(),
        "duration_s": rounded(summary.sweep.base.end.as_secs_f64()),
        "runs": summary.runs,
        "runs_asked_for": summary.cells,
        "survival": rows.collect::<Vec<_>>(),
        "version": env!("CARGO_PKG_VERSION"),
    }));
    if let Some(cost) = summary.sweep.system.quadratic_cost() {
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
    let known = figures::of(summary).into_iter();
    figures.extend(known.map(|figure| (figure.key.to_owned(), figure.json(row))));
    if summary.theory {
        let sure = json!(row.theory.sure);
        figures.insert("shrinks_whatever_the_pattern".to_owned(), sure);
    }
    Value::Object(figures)
}

/// The keys match those of a run's metrics.
fn run(summary: &SweepSummary, topics: &[String], cell: &Cell, outcome: &CellResult) -> Value {
    let system = &summary.sweep.system;
    let mut figures = conditions(&summary.sweep, cell);
    figures.insert(key(&summary.good), json!(!outcome.verdict.is_lost()));
    figures.extend(object(json!({
        "cause_of_end": outcome.verdict.name(),
        "mean_latency_ms": rounded(outcome.mean_latency_s.unwrap_or(0.0) * 1e3),
        "seed": cell.seed,
        "sim_time_s": rounded(outcome.sim_time.as_secs_f64()),
        "steps": outcome.steps,
    })));
    let ages = outcome.push_age.into_iter().flat_map(|age| {
        let ages = [
            ("mean_push_age_ms", age.run_s),
            ("late_push_age_ms", age.late_s),
        ];
        ages.map(|(name, seconds)| (name.to_owned(), json!(rounded(seconds * 1e3))))
    });
    figures.extend(ages);
    if !outcome.ages.is_empty() {
        figures.insert("age_parts".to_owned(), ages::json(&outcome.ages));
    }
    let cost = outcome
        .cost
        .map(|cost| ("quadratic_cost".to_owned(), json!(cost)));
    figures.extend(cost);
    add_figures(&mut figures, &outcome.figures);
    let dropped = topics.iter().zip(&outcome.dropped);
    figures.extend(dropped.map(|(topic, dropped)| {
        let name = format!("{}_dropped", key(topic));
        (name, json!(dropped))
    }));
    let finals = system
        .finals_at(outcome.sim_time, &outcome.state)
        .into_iter();
    figures.extend(finals.map(|figure| (figure.name.to_owned(), json!(rounded(figure.value)))));
    Value::Object(figures)
}

fn conditions(sweep: &Sweep, cell: &Cell) -> Map<String, Value> {
    let columns = columns::of(sweep).into_iter();
    let values = columns.map(|column| {
        let value = value(column.kind, &column.short(sweep, cell));
        (key(&column.name), value)
    });
    values.collect()
}
