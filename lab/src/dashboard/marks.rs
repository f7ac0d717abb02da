//! What the chart of the angle says of knobs.

use ratelab::{
    experiment::{Knob, TimedKnob},
    runtime::{Time, telemetry::Event},
};

/// Run time that the angle chart shows (s).
pub const TRACE_S: f64 = 10.0;

/// What the chart that ends at `now` says of `events`.
pub fn marks<'a>(events: impl Iterator<Item = &'a Event>, now: Time) -> Vec<(f64, String)> {
    let since = now.as_secs_f64() - TRACE_S;
    let marks = events.filter_map(|event| Some((event.at.as_secs_f64(), mark(event)?)));
    marks.filter(|(at, _)| *at >= since).collect()
}

/// What the chart says of an event: knobs only.
fn mark(event: &Event) -> Option<String> {
    TimedKnob::of(event).map(|timed| match timed.knob {
        Knob::ControlHz(hz) => format!("control {hz}"),
        Knob::SensorHz(hz) => format!("sensor {hz}"),
        Knob::QueueDepth(depth) => format!("depth {depth}"),
        Knob::Policy(policy) => policy.name().to_owned(),
    })
}
