//! `ratelab export`: a recording as an MCAP file for other tools.

use std::{collections::BTreeMap, io::Cursor, sync::Arc};

use mcap::{Channel, McapError, Message, Schema, Writer};
use serde_json::{Map, Value, json};

use crate::{
    cli::ExportArgs,
    error::Error,
    output::{OutputKind, print_line},
    program::Program,
    reading,
    table::{RunTables, TableSubject},
};
use ratelab_recording::printable::shown;

/// A second (ns).
const SECOND: u64 = 1_000_000_000;

/// The time since 1970 at run time 0 (ns). Tools for bags take a stamp of 0 for a missing one.
const BEGIN: u64 = SECOND;

// The columns with the time of a row, and with the header stamp of a message.
const TIME: &str = "time_s";
const STAMP: &str = "sensed_s";

/// Writes the messages, ticks and events of a recording as MCAP; of a damaged one the intact part.
pub fn export(program: &Program, args: &ExportArgs) -> Result<(), Error> {
    let recording = Arc::new(reading::read(&args.file)?);
    let tables = RunTables::new(&recording, &program.for_recording(&recording).system);
    let until = recording.until.as_nanos();
    let path = args
        .output
        .clone()
        .unwrap_or_else(|| args.file.with_extension("mcap"));
    let file = encoded(&tables, until).map_err(|why| {
        let why = format!("--output {}: {why}", path.display());
        Error::BadInput(why)
    })?;
    OutputKind::Bag.write("--output", &path, std::slice::from_ref(&args.file), &file)?;
    print_line(&format!(
        "{}: messages and ticks as JSON; run time 0 is 1 s since 1970",
        shown(&path)
    ))?;
    Error::if_damaged(&recording)
}

/// A row of a table, at its time (ns).
struct Row {
    at: u64,
    channel: usize,
    data: Vec<u8>,
}

/// Returns the tables as MCAP, of a run that went on until the run time `until` (ns).
fn encoded(tables: &RunTables, until: u64) -> Result<Vec<u8>, McapError> {
    let mut file = Cursor::new(Vec::new());
    let mut writer = Writer::new(&mut file)?;
    let (mut channels, mut rows) = (Vec::new(), Vec::new());
    for subject in tables.subjects() {
        let name = match tables.name(subject) {
            name if subject == TableSubject::Events => format!("/ratelab/{name}"),
            name => match (subject, name.split_once(' ')) {
                (TableSubject::Topic(_), Some((_, topic))) => topic.to_owned(),
                (TableSubject::Node(_), Some((_, node))) => format!("/ratelab/ticks/{node}"),
                // The mean ages of the whole run have no times.
                _ => continue,
            },
        };
        let columns = tables.columns(subject);
        let of_table = tables.rows(subject).into_iter();
        let number = channels.len();
        rows.extend(of_table.filter_map(|cells| row(&columns, &cells, number)));
        channels.push(channel(number, name, &columns));
    }
    let number = channels.len();
    let columns = [TIME.to_owned(), "event".to_owned()];
    let end = [(until as f64 / 1e9).to_string(), "end".to_owned()];
    rows.extend(row(&columns, &end, number));
    channels.push(channel(number, "/ratelab/end".to_owned(), &columns));
    rows.sort_by_key(|row| row.at);
    let mut numbers = vec![0; channels.len()];
    for Row { at, channel, data } in rows {
        numbers[channel] += 1;
        writer.write(&Message {
            channel: channels[channel].clone(),
            sequence: numbers[channel],
            log_time: at,
            publish_time: at,
            data: data.into(),
        })?;
    }
    writer.finish()?;
    drop(writer);
    Ok(file.into_inner())
}

/// Returns a channel of rows with these `columns`.
fn channel(number: usize, topic: String, columns: &[String]) -> Arc<Channel<'static>> {
    let id = number as u16 + 1;
    let time = json!({
        "type": "object",
        "properties": { "sec": { "type": "integer" }, "nanosec": { "type": "integer" } },
    });
    let header = json!({ "type": "object", "properties": { "stamp": time } });
    let named = columns.iter().map(|name| {
        let kind = json!({ "type": ["number", "string", "null"] });
        (name.clone(), kind)
    });
    let properties = named.chain([("header".to_owned(), header)]);
    let properties: Map<String, Value> = properties.collect();
    let schema = json!({ "type": "object", "title": topic, "properties": properties });
    Arc::new(Channel {
        id,
        schema: Some(Arc::new(Schema {
            id,
            name: format!("ratelab{}", topic.replace('/', ".")),
            encoding: "jsonschema".to_owned(),
            data: schema.to_string().into_bytes().into(),
        })),
        topic,
        message_encoding: "json".to_owned(),
        metadata: BTreeMap::new(),
    })
}

/// Returns a row as JSON, the row of a message with its header stamp first; `None` without a time.
fn row(columns: &[String], cells: &[String], channel: usize) -> Option<Row> {
    let cell = |name: &str| {
        columns
            .iter()
            .zip(cells)
            .find(|(column, _)| *column == name)
            .map(|(_, cell)| cell)
    };
    let nanos = |name: &str| {
        let seconds: f64 = cell(name)?.parse().ok()?;
        Some(BEGIN + (seconds * 1e9).round().max(0.0) as u64)
    };
    let values = columns.iter().zip(cells).map(|(column, cell)| {
        let number = cell.parse().ok().filter(|number: &f64| number.is_finite());
        let value = match number {
            Some(number) => json!(number),
            None if cell.is_empty() => Value::Null,
            None => json!(cell),
        };
        format!("{}:{value}", json!(column))
    });
    let stamp = nanos(STAMP).map(|stamp| {
        let (sec, nanosec) = (stamp / SECOND, stamp % SECOND);
        format!(r#""header":{{"stamp":{{"sec":{sec},"nanosec":{nanosec}}}}}"#)
    });
    let all: Vec<String> = stamp.into_iter().chain(values).collect();
    Some(Row {
        at: nanos(TIME)?,
        channel,
        data: format!("{{{}}}", all.join(",")).into_bytes(),
    })
}
