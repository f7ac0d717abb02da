//! What a sweep came to, for programs.

use ratelab::experiment::sweep::{Cell, CellResult, Swept};
use serde_json::{Map, Value, json};

use super::summary::{RateSummary, SweepSummary};
use crate::metrics::{object, rounded};

/// The sweep as JSON: how often the pole stayed up, then every run. It holds
/// nothing of the wall's, so the same sweep gives the same bytes.
pub fn text(summary: &SweepSummary, swept: &Swept, theory: bool) -> String {
    let rows = summary.rows().iter().map(|row| survival(row, theory));
    let cells = swept.finished().map(|(cell, outcome)| run(&cell, outcome));
    let whole = json!({
        "cells": cells.collect::<Vec<_>>(),
        "complete": swept.is_complete(),
        "duration_s": rounded(summary.sweep.base.end.as_secs_f64()),
        "runs": summary.runs,
        "runs_asked_for": summary.cells,
        "survival": rows.collect::<Vec<_>>(),
        "version": env!("CARGO_PKG_VERSION"),
    });
    format!("{whole:#}")
}

fn survival(row: &RateSummary, theory: bool) -> Value {
    let mut figures = conditions(&row.cell);
    figures.extend(object(json!({
        "balanced": row.balanced,
        "mean_latency_ms": row.mean_latency_s.map(|s| rounded(s * 1e3)),
        "median_lost_at_s": row.lost_at_s.map(rounded),
        "runs": row.runs,
        "share": row.share().map(rounded),
    })));
    if theory {
        figures.insert("growth_per_s".to_owned(), json!(row.growth.map(rounded)));
    }
    Value::Object(figures)
}

/// The names are those of a run's metrics.
fn run(cell: &Cell, outcome: &CellResult) -> Value {
    let mut figures = conditions(cell);
    figures.extend(object(json!({
        "action_dropped": outcome.action_dropped,
        "balanced": outcome.verdict.balanced(),
        "cause_of_end": outcome.verdict.name(),
        "final_pole_angle": rounded(outcome.final_pole_angle),
        "mean_latency_ms": rounded(outcome.mean_latency_s.unwrap_or(0.0) * 1e3),
        "obs_dropped": outcome.obs_dropped,
        "seed": cell.seed,
        "sim_time_s": rounded(outcome.sim_time.as_secs_f64()),
        "steps": outcome.steps,
    })));
    Value::Object(figures)
}

fn conditions(cell: &Cell) -> Map<String, Value> {
    object(json!({
        "control_hz": cell.control_hz.get(),
        "policy": cell.policy.name(),
        "queue_depth": cell.queue_depth.get(),
        "sensor_hz": cell.sensor_hz.get(),
    }))
}
