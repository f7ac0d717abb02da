//! `ratelab export`: a recording in other formats: tables, a trace, a page, an MCAP file.

use std::{
    collections::{BTreeMap, BTreeSet},
    io::Cursor,
    path::{Path, PathBuf},
    slice,
    sync::Arc,
};

use mcap::{Channel, McapError, Message, Schema, Writer};
use ratatui::layout::Size;
use ratelab_recording::{Recording, printable::shown};
use ratelab_screen::{Look, picture};
use ratelab_system::{
    Alias, System,
    names::{self, key},
};
use serde_json::{Map, Value, json};

use crate::{
    cli::{ExportArgs, ExportWebArgs, TableArgs, TraceArgs},
    error::Error,
    output::{NewFolders, OutputFile, OutputKind, print_line},
    program::{self, Program},
    reading,
    screen::{pictured, theme},
    table::{RunTables, TableSubject},
    trace::trace as encoded,
    web,
};

/// The option for the folder.
const OUTPUT: &str = "--output";

/// Writes a table for each topic and node of a recording, one for its ages and one for its events;
/// of a damaged one the intact part.
pub fn table(program: &Program, args: &TableArgs) -> Result<(), Error> {
    let recording = Arc::new(reading::read(&args.file)?);
    let tables = RunTables::new(&recording, &program.for_recording(&recording).system);
    let folder = args
        .output
        .clone()
        .unwrap_or_else(|| args.file.with_extension(""));
    let made = NewFolders::leading_to(&folder);
    let _empty = made.map_err(|why| Error::unwritable(OUTPUT, &folder, &why))?;
    let subjects = tables.subjects();
    let paths = paths(&folder, &tables, &subjects);
    // All are opened before the first is written.
    let open = |(subject, path): (&TableSubject, &PathBuf)| {
        OutputKind::Rows(&tables.header(*subject)).open(OUTPUT, path)
    };
    let files: Vec<OutputFile> = subjects
        .iter()
        .zip(&paths)
        .map(open)
        .collect::<Result<_, _>>()?;
    for (file, subject) in files.into_iter().zip(&subjects) {
        file.write(tables.text(*subject).as_bytes())?;
    }
    print_line(&format!("{}: {} tables", shown(&folder), paths.len()))?;
    Error::if_damaged(&recording)
}

/// Returns the files of the tables in `folder`, each with another name.
fn paths(folder: &Path, tables: &RunTables, subjects: &[TableSubject]) -> Vec<PathBuf> {
    let mut taken = BTreeSet::new();
    let paths = subjects.iter().map(|subject| {
        let name = key(&tables.name(*subject));
        let others = (2..).map(|number| format!("{name}_{number}"));
        let mut names = [name.clone()].into_iter().chain(others);
        // File systems may not tell capitals from small letters.
        let name = names.find(|name| taken.insert(name.to_lowercase()));
        folder.join(format!("{}.csv", name.unwrap_or_default()))
    });
    paths.collect()
}

/// Writes a recording as a trace; the intact part of a damaged one.
pub fn trace(program: &Program, args: &TraceArgs) -> Result<(), Error> {
    let recording = reading::read(&args.file)?;
    let path = args
        .output
        .clone()
        .unwrap_or_else(|| args.file.with_extension("pftrace"));
    let system = recording.system(&program.for_recording(&recording).system);
    let (read, trace) = (slice::from_ref(&args.file), encoded(&recording, &*system));
    OutputKind::Trace.write("--output", &path, read, &trace)?;
    print_line(&format!(
        "{}: open it in https://ui.perfetto.dev\nwithout a network {} replay shows the run",
        shown(&path),
        program::name(),
    ))?;
    Error::if_damaged(&recording)
}

/// Size of the picture for readers without JavaScript.
const SIZE: Size = Size::new(120, 35);

/// Writes the page; of damaged recordings with their intact part.
pub fn export_web(program: &Program, args: &ExportWebArgs) -> Result<(), Error> {
    let recordings = args
        .files
        .iter()
        .map(|file| Ok(Arc::new(reading::read(file)?)))
        .collect::<Result<Vec<_>, Error>>()?;
    let program = &program.for_recording(&recordings[0]);
    refuse_strangers(program, &recordings)?;
    let system = &*program.system;
    let differs = differing(system, &recordings);
    let mut runs: Vec<(String, Arc<Recording>)> = recordings
        .iter()
        .map(|recording| (setting(system, differs, recording), recording.clone()))
        .collect();
    if differs.is_some() {
        let number = |text: &str| text.split(' ').next().and_then(|n| n.parse::<f64>().ok());
        runs.sort_by(|(one, _), (other, _)| {
            let [one, other] = [one, other].map(|text| number(text).unwrap_or(f64::MAX));
            one.total_cmp(&other)
        });
    }
    let first = runs[0].1.clone();
    let (at, theme) = (first.until, theme(false, Some(Look::Light)));
    let poster = picture::draw_recording(first, pictured(program, args.limits), at, SIZE, &theme)?;
    let data = runs.iter().map(|(setting, recording)| {
        let mut data = web::data(recording, program, setting);
        if args.limits {
            data["limits"] = web::limits(recording, system);
        }
        data
    });
    let runs: Vec<Value> = data.collect();
    let quantity = differs.map_or_else(String::new, |alias| names::label(alias.name));
    let page = web::page(system.name(), &quantity, &runs, &poster);
    OutputKind::Page.write("--output", &args.output, &args.files, page.as_bytes())?;
    let file = shown(&args.output);
    print_line(&format!("{file}: open it in a browser"))?;
    recordings.iter().try_for_each(|one| Error::if_damaged(one))
}

/// Refuses recordings of other systems.
fn refuse_strangers(program: &Program, recordings: &[Arc<Recording>]) -> Result<(), Error> {
    for (place, recording) in recordings.iter().enumerate() {
        if recording.is_of(&*program.system) {
            continue;
        }
        let (file, of) = (recording.path.display(), &recording.origin.system);
        return Err(Error::BadInput(match place {
            0 => format!("{file}: this is a recording of {of:?}: use the program that has it"),
            _ => format!(
                "{file}: this is a recording of another graph ({of:?}) than the first: \
                 a page holds runs of one graph"
            ),
        }));
    }
    Ok(())
}

/// Returns the first of the system's settings in which the recordings differ.
fn differing(system: &dyn System, recordings: &[Arc<Recording>]) -> Option<&'static Alias> {
    let value = |alias: &Alias, of: &Recording| alias.value(&of.origin.config.setup);
    system.knobs().aliases().iter().find(|alias| {
        let mut values = recordings.iter().map(|recording| value(alias, recording));
        let first = values.next();
        values.any(|other| Some(other) != first)
    })
}

/// Returns the value of that setting in a recording, with its unit.
fn setting(system: &dyn System, alias: Option<&Alias>, of: &Recording) -> String {
    alias.map_or_else(String::new, |alias| {
        let value = names::short_value(system, alias, &of.origin.config.setup);
        format!("{value}{}", names::unit(alias.name, alias.kind()))
    })
}

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
    let file = mcap_bytes(&tables, until).map_err(|why| {
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
fn mcap_bytes(tables: &RunTables, until: u64) -> Result<Vec<u8>, McapError> {
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
