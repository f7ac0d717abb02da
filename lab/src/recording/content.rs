//! From the chunks of a file to messages, ticks and events.

use std::time::Duration;

use ratelab::runtime::{
    Ticked, Time,
    telemetry::{Event, Shape},
};
use rerun::{archetypes::Scalars, log::Chunk};
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::{
    reader::{Head, Track},
    schema::{
        CHECKPOINT, END, EVENTS, FORMAT, JSON, ORIGIN, Origin, Outcome, UNTIL, message,
        node_entity, tick, topic_entity,
    },
    timeline::RUN_TIME,
    tracks::NANOS_PER_MICRO,
};
use crate::printable::is_control;

/// What was found in a file so far.
#[derive(Default)]
pub struct Content {
    /// What was run; nothing is taken of the file before this is known.
    pub origin: Option<Origin>,
    /// What the topics carried.
    pub topics: Vec<Track>,
    /// The ticks of the nodes.
    pub ticks: Vec<Vec<Ticked>>,
    /// Commands and ends.
    pub events: Vec<Event>,
    /// Run time up to which all of these are complete; `None` before anything is.
    pub until: Option<Time>,
    /// How the recording ended.
    pub outcome: Option<Outcome>,
    /// What could not be understood.
    pub damage: Option<&'static str>,
}

impl Content {
    /// Adds what is in `chunk`, if it is anything of ours.
    ///
    /// # Errors
    /// In words, if what the recording says of itself is not understood.
    pub fn add(&mut self, chunk: &Chunk) -> Result<(), String> {
        let entity = chunk.entity_path().to_string();
        if entity.ends_with(&format!("__properties/{ORIGIN}")) {
            return self.begin(chunk);
        }
        let Some(origin) = &self.origin else {
            return Ok(());
        };
        let Shape { nodes, topics } = &origin.shape;
        if let Some(index) = topics.iter().position(|t| topic_entity(&t.name) == entity) {
            add_messages(&mut self.topics[index], chunk);
        } else if let Some(index) = nodes.iter().position(|n| node_entity(&n.name) == entity) {
            add_ticks(&mut self.ticks[index], chunk);
        }
        match entity.as_str() {
            EVENTS => {
                for event in json(chunk) {
                    match event {
                        Some(event) => self.events.push(event),
                        None => self.damage = Some("an event in it is damaged"),
                    }
                }
            }
            END => {
                self.outcome = json::<Outcome>(chunk).next().flatten();
                let at = self.outcome.as_ref().map(|outcome| outcome.at);
                self.until = at.or(self.until);
            }
            CHECKPOINT => {
                let until = numbers(chunk, UNTIL).flatten().last();
                self.until = until.map(Time::from_nanos).or(self.until);
            }
            _ => {}
        }
        Ok(())
    }

    fn begin(&mut self, chunk: &Chunk) -> Result<(), String> {
        let Some(text) = texts(chunk).next() else {
            return Ok(());
        };
        let format = serde_json::from_str(&text).ok();
        let format = format.and_then(|json: serde_json::Value| json.get("format")?.as_u64());
        if let Some(format) = format.filter(|format| *format > u64::from(FORMAT)) {
            return Err(format!(
                "this recording is of format {format}, this ratelab reads up to {FORMAT}: \
                 a later one made it"
            ));
        }
        let origin: Origin =
            parsed(&text).ok_or("what this recording says of itself is damaged")?;
        self.topics = vec![Track::default(); origin.shape.topics.len()];
        self.ticks = vec![Vec::new(); origin.shape.nodes.len()];
        self.origin = Some(origin);
        Ok(())
    }
}

fn add_messages(track: &mut Track, chunk: &Chunk) {
    let origins = numbers(chunk, message::ORIGIN).map(|origin| origin.map(Time::from_nanos));
    let heads = stamps(chunk).zip(numbers(chunk, message::SEQ)).zip(origins);
    let heads = heads.zip(numbers(chunk, message::DROPPED));
    let rows = chunk.iter_slices::<f64>(Scalars::descriptor_scalars().component);
    for ((((stamp, seq), origin), dropped), row) in heads.zip(rows) {
        if track.heads.is_empty() {
            track.width = row.len();
        }
        // Others are not ours; the end of the file counts what is missing.
        if row.len() == track.width {
            track.heads.push(Head {
                stamp,
                seq: seq.unwrap_or(0),
                origin,
                dropped: dropped.unwrap_or(0),
            });
            track.values.extend(row);
        }
    }
}

fn add_ticks(ticks: &mut Vec<Ticked>, chunk: &Chunk) {
    let durations =
        |name: &'static str| numbers(chunk, name).map(|nanos| nanos.map(Duration::from_nanos));
    let rows = stamps(chunk).zip(numbers(chunk, tick::NUMBER));
    let lateness = chunk.iter_slices::<f64>(Scalars::descriptor_scalars().component);
    let lateness = lateness.map(|row| row.first().copied().and_then(lateness_of));
    let rows = rows.zip(lateness).zip(durations(tick::TOOK));
    let rows = rows.zip(numbers(chunk, tick::OVERRUNS));
    ticks.extend(
        rows.map(|((((at, number), lateness), took), overruns)| Ticked {
            number: number.unwrap_or(0),
            at,
            lateness,
            took,
            overruns: overruns.unwrap_or(0),
        }),
    );
}

/// To the nanosecond, up to 26 days.
fn lateness_of(micros: f64) -> Option<Duration> {
    (micros >= 0.0).then(|| Duration::from_nanos((micros * NANOS_PER_MICRO).round() as u64))
}

/// Run times of the rows of `chunk`.
fn stamps(chunk: &Chunk) -> impl Iterator<Item = Time> {
    let column = chunk.timelines().get(&RUN_TIME.into());
    let times = column.map_or(&[][..], |column| column.times_raw());
    let nanos = times.iter().map(|nanos| u64::try_from(*nanos));
    nanos.map(|nanos| Time::from_nanos(nanos.unwrap_or(0)))
}

/// The component `name` of the rows of `chunk`, one number or none each.
fn numbers(chunk: &Chunk, name: &'static str) -> impl Iterator<Item = Option<u64>> {
    let rows = chunk.iter_slices::<Option<u64>>(name.into());
    rows.map(|mut row| row.next().flatten())
}

/// The texts of the rows of `chunk`.
fn texts(chunk: &Chunk) -> impl Iterator<Item = String> {
    let rows = chunk.iter_slices::<String>(JSON.into());
    rows.filter_map(|row| row.first().map(|text| text.as_str().to_owned()))
}

/// What the texts of the rows of `chunk` stand for; `None` where they do not.
fn json<T: DeserializeOwned>(chunk: &Chunk) -> impl Iterator<Item = Option<T>> {
    texts(chunk).map(|text| parsed(&text))
}

/// The value that `text` stands for. Its texts can be printed: a file may hold
/// anything, what commands a terminal among it.
fn parsed<T: DeserializeOwned>(text: &str) -> Option<T> {
    let mut value = serde_json::from_str(text).ok()?;
    make_printable(&mut value);
    serde_json::from_value(value).ok()
}

fn make_printable(value: &mut Value) {
    match value {
        Value::String(text) => *text = text.replace(is_control, "?"),
        Value::Array(values) => values.iter_mut().for_each(make_printable),
        Value::Object(map) => map.values_mut().for_each(make_printable),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::parsed;

    #[test]
    fn a_text_from_a_file_does_nothing_to_a_terminal() {
        let text = parsed::<String>(r#""a\u001b[31m\u202eb""#);
        assert_eq!(text.as_deref(), Some("a?[31m?b"));
    }
}
