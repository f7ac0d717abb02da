//! The beginning of a recording: its layout, and its description for people in the viewer's
//! panel, and in one piece for readers.

use std::sync::Arc;

use ratelab::TimedKnob;
use ratelab_study::{
    experiment::Summary,
    system::{KnobText, System},
};
use rerun::{
    AnyValues, RecordingStream, RecordingStreamBuilder,
    external::arrow::array::{ArrayRef, Float64Array, StringArray, UInt64Array},
};

use super::{
    blueprint::{self, Subject},
    file::RecordingFile,
    schema::{APPLICATION, JSON, ORIGIN, Origin},
    source::Source,
    timeline::Written,
    tracks::AttachedTaps,
    viewer::FileAndViewer,
};

/// A stream to `file` with its layout and description.
pub fn begin(
    file: &RecordingFile,
    taps: &AttachedTaps,
    source: &Source,
) -> Written<RecordingStream> {
    let Source { system, origin, .. } = source;
    let config = &origin.config;
    let name = format!(
        "{}, {} clock, seed {}",
        origin.system, config.clock, config.seed
    );
    let rec = RecordingStreamBuilder::new(APPLICATION)
        .enabled(true)
        .recording_name(name)
        .buffered()?;
    match &source.viewer {
        None => rec.set_sink(Box::new(file.clone())),
        Some(viewer) => rec.set_sink(Box::new(FileAndViewer::new(file.clone(), viewer))),
    }
    // Readers need this first, and columns overtake logged messages.
    send_origin(&rec, &**system, origin)?;
    let _ = rec.flush_blocking();
    let layout = Subject {
        system: &**system,
        picture: source.has_picture(),
        start: &source.start,
        clock: source.observer.status().clock,
    };
    blueprint::send(&rec, &layout)?;
    taps.begin(&rec, source)?;
    Ok(rec)
}

/// Sends the description of a run of `system`.
fn send_origin(rec: &RecordingStream, system: &dyn System, origin: &Origin) -> Written {
    rec.send_property("run", &run(system, origin))?;
    let json = serde_json::to_string(origin).unwrap_or_default();
    let values = AnyValues::default().with_component_from_data(JSON, text(json));
    rec.send_property(ORIGIN, &values)
}

fn run(system: &dyn System, origin: &Origin) -> AnyValues {
    let config = &origin.config;
    let settings = config.setup.iter().map(ToString::to_string);
    let settings: Vec<String> = settings.collect();
    AnyValues::default()
        .with_component_from_data("system", text(origin.system.clone()))
        .with_component_from_data("seed", count(config.seed))
        .with_component_from_data("clock", text(config.clock.to_string()))
        .with_component_from_data("settings", text(settings.join("\n")))
        .with_component_from_data("made_by", text(origin.made_by()))
        .with_component_from_data("knobs_given", text(lines(system, &config.knobs)))
}

/// Sends the summary of the run.
pub fn send_summary(rec: &RecordingStream, system: &dyn System, summary: &Summary) -> Written {
    let dropped = summary.topics.iter().filter(|topic| topic.is_read());
    let dropped = dropped.map(|topic| format!("{} {}", topic.name, topic.dropped()));
    let dropped: Vec<String> = dropped.collect();
    let mut values = AnyValues::default()
        .with_component_from_data("verdict", text(summary.verdict.to_string()))
        .with_component_from_data("steps", count(summary.steps))
        .with_component_from_data("run_time_s", number(summary.sim_time.as_secs_f64()))
        .with_component_from_data("dropped", text(dropped.join("\n")))
        .with_component_from_data("knobs_turned", text(lines(system, &summary.knobs())));
    if let Some(mean) = summary.latency.mean_s() {
        values = values.with_component_from_data("mean_latency_ms", number(mean * 1e3));
    }
    rec.send_property("outcome", &values)
}

/// Knobs as text for `--knobs`.
fn lines(system: &dyn System, knobs: &[TimedKnob]) -> String {
    KnobText(system.aliases()).lines(knobs).join("\n")
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
