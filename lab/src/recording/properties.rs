//! What a recording says of itself beside its data: for people in the viewer's
//! panel, and in one piece for readers.

use std::sync::Arc;

use ratelab::experiment::{Config, Summary, TimedKnob};
use rerun::{
    AnyValues, RecordingStream, RecordingStreamResult,
    external::arrow::array::{ArrayRef, Float64Array, StringArray, UInt64Array},
};

use super::schema::{JSON, ORIGIN, Origin};

/// Says what is run.
pub fn send_origin(rec: &RecordingStream, origin: &Origin) -> RecordingStreamResult<()> {
    rec.send_property("run", &run(origin))?;
    let json = serde_json::to_string(origin).unwrap_or_default();
    let values = AnyValues::default().with_component_from_data(JSON, text(json));
    rec.send_property(ORIGIN, &values)
}

fn run(origin: &Origin) -> AnyValues {
    let config: &Config = &origin.config;
    AnyValues::default()
        .with_component_from_data("seed", count(config.seed))
        .with_component_from_data("policy", text(config.policy.to_string()))
        .with_component_from_data("clock", text(config.clock.to_string()))
        .with_component_from_data("control_hz", number(config.control_hz.get()))
        .with_component_from_data("sensor_hz", number(config.sensor_hz.get()))
        .with_component_from_data("queue_depth", count(config.queue_depth.get() as u64))
        .with_component_from_data("ratelab", text(origin.ratelab.clone()))
        .with_component_from_data("mujoco", text(origin.mujoco.clone()))
        .with_component_from_data("platform", text(origin.platform.clone()))
        .with_component_from_data("knobs_given", text(lines(&config.knobs)))
}

/// Says what the run came to.
pub fn send_summary(rec: &RecordingStream, summary: &Summary) -> RecordingStreamResult<()> {
    let mean_ms = summary.latency.mean_s().unwrap_or(0.0) * 1e3;
    let values = AnyValues::default()
        .with_component_from_data("verdict", text(summary.verdict.to_string()))
        .with_component_from_data("steps", count(summary.steps))
        .with_component_from_data("run_time_s", number(summary.sim_time.as_secs_f64()))
        .with_component_from_data("mean_latency_ms", number(mean_ms))
        .with_component_from_data("obs_dropped", count(summary.obs.dropped))
        .with_component_from_data("action_dropped", count(summary.action.dropped))
        .with_component_from_data("knobs_turned", text(lines(&summary.knobs())));
    rec.send_property("outcome", &values)
}

/// Knobs as `--knobs` reads them.
fn lines(knobs: &[TimedKnob]) -> String {
    let lines: Vec<String> = knobs.iter().map(TimedKnob::to_string).collect();
    lines.join("\n")
}

fn text(text: String) -> ArrayRef {
    Arc::new(StringArray::from(vec![text]))
}

fn number(number: f64) -> ArrayRef {
    Arc::new(Float64Array::from(vec![number]))
}

fn count(count: u64) -> ArrayRef {
    Arc::new(UInt64Array::from(vec![count]))
}
