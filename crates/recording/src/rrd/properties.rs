//! The beginning of a recording: its layout, its description in one piece for readers, and the
//! names of the numbers in messages.

use std::sync::Arc;

use rerun::{
    AnyValues, RecordingStream, RecordingStreamBuilder, SeriesLines,
    external::arrow::array::{ArrayRef, StringArray},
};

use super::{
    blueprint,
    file::RecordingFile,
    schema::{APPLICATION, JSON, ORIGIN, topic_entity},
    timeline::Written,
    viewer::{FileAndViewer, Viewer},
};
use crate::recorder::Source;

/// Opens a stream to `file`, and to `viewer` if any, with layout and description.
pub fn begin(
    file: &RecordingFile,
    viewer: Option<&Viewer>,
    source: &Source,
) -> Written<RecordingStream> {
    let (origin, config) = (&source.origin, &source.origin.config);
    let name = format!(
        "{}, {} clock, seed {}",
        origin.system, config.clock, config.seed
    );
    let rec = RecordingStreamBuilder::new(APPLICATION)
        .enabled(true)
        .recording_name(name)
        .buffered()?;
    match viewer {
        None => rec.set_sink(Box::new(file.clone())),
        Some(viewer) => rec.set_sink(Box::new(FileAndViewer::new(file.clone(), viewer))),
    }
    // Readers need this first, and columns overtake logged messages.
    let json = serde_json::to_string(origin).unwrap_or_default();
    let json: ArrayRef = Arc::new(StringArray::from(vec![json]));
    let description = AnyValues::default().with_component_from_data(JSON, json);
    rec.send_property(ORIGIN, &description)?;
    let _ = rec.flush_blocking();
    blueprint::send(&rec, source)?;
    for topic in &origin.topology.topics {
        if let Some(fields) = source.taps.fields(&topic.name) {
            let names = SeriesLines::new().with_names(fields.iter().map(String::as_str));
            rec.log_static(topic_entity(&topic.name), &names)?;
        }
    }
    Ok(rec)
}
