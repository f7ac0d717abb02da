//! What a run came to, for programs.

use std::time::Duration;

use ratelab::{
    experiment::{NodeSummary, Summary, TimedKnob},
    runtime::telemetry::Distribution,
};
use serde_json::{Map, Value, json};

use crate::report::{ReportContext, saw_the_wall};

/// The metrics as JSON: first the keys of the course's artifact, then ours.
///
/// Under the virtual clock they hold nothing of the wall's, so the same run
/// gives the same bytes.
pub fn json(summary: &Summary, context: &ReportContext) -> String {
    let mut metrics = course_keys(summary, context);
    metrics.extend(own_keys(summary, context));
    if saw_the_wall(summary) {
        metrics.extend(wall_keys(summary, context));
    }
    format!("{:#}", Value::Object(metrics))
}

fn course_keys(summary: &Summary, context: &ReportContext) -> Map<String, Value> {
    let config = &summary.config;
    object(json!({
        "action_dropped": summary.action.dropped,
        "action_published": summary.action.published,
        "balanced": summary.verdict.balanced(),
        "break_bug": context.break_bug,
        "clock": config.clock.to_string(),
        "control_hz": rounded(config.control_hz.get()),
        "final_pole_angle": rounded(summary.final_pole_angle),
        "mean_latency_ms": rounded(summary.latency.mean_s().unwrap_or(0.0) * 1e3),
        "obs_dropped": summary.obs.dropped,
        "obs_published": summary.obs.published,
        "queue_depth": config.queue_depth.get(),
        "seed": config.seed,
        "sensor_hz": rounded(config.sensor_hz.get()),
        "sim_time_s": rounded(summary.sim_time.as_secs_f64()),
        "smoke": context.smoke,
        "steps": summary.steps,
    }))
}

fn own_keys(summary: &Summary, context: &ReportContext) -> Map<String, Value> {
    let config = &summary.config;
    object(json!({
        "cause_of_end": summary.verdict.name(),
        "csv_rows_lost": context.csv_lost,
        "duration_s": rounded(config.end.as_secs_f64()),
        "events": summary.events.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "knobs": config.knobs.iter().map(TimedKnob::to_string).collect::<Vec<_>>(),
        "latency": milliseconds(&summary.latency),
        "nodes": summary.nodes.iter().map(node).collect::<Map<_, _>>(),
        "policy": config.policy.to_string(),
        "turned": summary.knobs().iter().map(TimedKnob::to_string).collect::<Vec<_>>(),
        "version": env!("CARGO_PKG_VERSION"),
    }))
}

fn wall_keys(summary: &Summary, context: &ReportContext) -> Map<String, Value> {
    let lateness = summary.nodes.iter();
    let lateness = lateness.map(|node| (node.name.clone(), milliseconds(&node.lateness)));
    let tick_time = summary.nodes.iter();
    let tick_time = tick_time.map(|node| (node.name.clone(), milliseconds(&node.tick_time)));
    object(json!({
        "lateness": lateness.collect::<Map<_, _>>(),
        "realtime": context.realtime.as_ref().map(|asked| match asked {
            Ok(()) => "granted".to_owned(),
            Err(refusal) => refusal.clone(),
        }),
        "tick_time": tick_time.collect::<Map<_, _>>(),
        "wall_time_s": rounded(summary.wall_time.as_secs_f64()),
    }))
}

fn node(node: &NodeSummary) -> (String, Value) {
    let figures = json!({
        "hz": rounded(node.hz.get()),
        "overruns": node.overruns,
        "ticks": node.ticks,
    });
    (node.name.clone(), figures)
}

/// A distribution in milliseconds; quantiles are true to 0.1 %.
fn milliseconds(distribution: &Distribution) -> Value {
    let ms = |duration: Option<Duration>| duration.map(|d| rounded(d.as_secs_f64() * 1e3));
    json!({
        "count": distribution.count(),
        "max_ms": ms(distribution.max()),
        "mean_ms": distribution.mean_s().map(|mean| rounded(mean * 1e3)),
        "p50_ms": ms(distribution.quantile(0.5)),
        "p99_ms": ms(distribution.quantile(0.99)),
    })
}

/// Four places, as in the course's artifact.
pub fn rounded(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

/// The members of `value`, which is an object.
pub fn object(value: Value) -> Map<String, Value> {
    match value {
        Value::Object(map) => map,
        _ => Map::new(),
    }
}
