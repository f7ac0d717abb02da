//! Altered recordings: decoded, changed in one place, and encoded again without a trace
//! of the change.

use rand::{Rng, seq::IndexedRandom};
use rerun::{
    external::arrow::array::{AsArray, RecordBatch},
    log::LogMsg,
};
use serde_json::{Value, json};

use crate::{
    cases::{RandomSource, chance},
    cells::{change_cell, change_rows, flip_bit, set_number, set_text},
    lies::change_json,
};

/// Columns of messages and ticks that are altered. The others are for the viewer and for
/// people: `wall_time`, `control_step` and `rerun.controls.RowId` place a row there, and what
/// tables of other entities show is computed from the messages.
pub const COLUMNS: [&str; 12] = [
    "run_time",
    "seq",
    "origin_ns",
    "dropped",
    "tick",
    "overruns",
    "took_ns",
    "pushed_ns",
    "sensed_ns",
    "stamp_ns",
    "arrives_ns",
    "Scalars:scalars",
];

/// Columns of the log of the threads.
pub const OF_THREADS: [&str; 4] = ["piece", "thread", "bytes", "digest"];

/// Entities with JSON, altered by field: configuration, events and end. They are never
/// doubled, because a repeated row has the same meaning. Their run time is never altered,
/// because it only places them in the viewer.
const JSON: [&str; 3] = ["/__properties/origin", "/events", "/end"];

/// The entity of the table in `message`, if it belongs to the recording itself.
pub fn entity(message: &LogMsg) -> Option<(&str, &RecordBatch)> {
    match message {
        LogMsg::ArrowMsg(store, table) if store.is_recording() => {
            let schema = table.batch.schema_ref();
            let entity = schema.metadata().get("rerun:entity_path")?;
            Some((entity, &table.batch))
        }
        _ => None,
    }
}

/// Whether `message` holds messages of a topic or ticks of a node.
pub fn is_series(message: &LogMsg) -> bool {
    entity(message).is_some_and(|(entity, table)| {
        let ours = entity.starts_with("/topics/") || entity.starts_with("/nodes/");
        ours && table.column_by_name("run_time").is_some()
    })
}

/// Whether `message` holds JSON for readers.
pub fn is_json(message: &LogMsg) -> bool {
    entity(message).is_some_and(|(entity, table)| {
        JSON.contains(&entity) && table.column_by_name("json").is_some()
    })
}

/// Whether `message` holds a part of the log of the threads.
pub fn is_threads(message: &LogMsg) -> bool {
    entity(message).is_some_and(|(entity, _)| entity == "/threads")
}

/// Changes one thing in a recording, or moves its beginning; describes the change.
pub fn alter(messages: &mut Vec<LogMsg>, random: &mut RandomSource) -> String {
    if chance(random, 3) {
        return begin_late(messages, random);
    }
    let wanted = match random.random_range(0..100) {
        0..45 => is_json,
        45..65 if messages.iter().any(is_threads) => is_threads,
        _ => is_series,
    };
    let places = (0..messages.len()).filter(|at| wanted(&messages[*at]));
    let at = *places.collect::<Vec<_>>().choose(random).expect("a table");
    let name = entity(&messages[at]).expect("a table").0.to_owned();
    let (json, threads) = (is_json(&messages[at]), is_threads(&messages[at]));
    let kind = random.random_range(0..100);
    match kind {
        0..4 => {
            drop(messages.remove(at));
            return format!("{name}: all of it removed");
        }
        4..7 if !json && !threads => {
            messages.insert(at, messages[at].clone());
            return format!("{name}: all of it doubled");
        }
        _ => {}
    }
    let LogMsg::ArrowMsg(_, content) = &mut messages[at] else {
        panic!("{name} is no table");
    };
    let table = &mut content.batch;
    let how = match kind {
        _ if json => change_texts(&name, table, random),
        _ if threads => change_column(table, &OF_THREADS, random),
        ..10 => remove_column(table, random),
        10..25 => change_rows(table, random),
        _ => change_column(table, &COLUMNS, random),
    };
    format!("{name}: {how}")
}

/// Changes a cell, or a bit of bytes, in one of `columns`; describes the change.
fn change_column(table: &mut RecordBatch, columns: &[&str], random: &mut RandomSource) -> String {
    let schema = table.schema();
    let there = columns
        .iter()
        .filter(|column| schema.index_of(column).is_ok());
    let there: Vec<_> = there.collect();
    let column = *there.choose(random).expect("a column");
    let index = schema.index_of(column).expect("a column");
    let how = match *column {
        "bytes" => flip_bit(table, index, random),
        _ => change_cell(table, index, random),
    };
    format!("{column}, {how}")
}

/// Keeps one message of each topic and one tick of each node, with a run time and a
/// number that a run reaches late or never. A verification must not run that far.
fn begin_late(messages: &mut [LogMsg], random: &mut RandomSource) -> String {
    let late = i64::MAX >> random.random_range(0..32);
    for message in &mut *messages {
        let (series, json) = (is_series(message), is_json(message));
        let LogMsg::ArrowMsg(_, content) = message else {
            continue;
        };
        let table = &mut content.batch;
        if series {
            *table = table.slice(0, 1);
            for column in ["run_time", "seq", "tick"] {
                set_number(table, column, late);
            }
        } else if json {
            edit_json(table, 0, |value| {
                let fields = [
                    ("/config/end", json!(u64::MAX)),
                    ("/at", json!(late)),
                    ("/end/Ended/sim_time", json!(late)),
                    ("/messages", json!([1, 1, 1])),
                    ("/ticks", json!([1, 1, 1])),
                ];
                for (field, lie) in fields {
                    if let Some(place) = value.pointer_mut(field) {
                        *place = lie;
                    }
                }
            });
        }
    }
    format!("all begins and ends at {late} ns")
}

fn remove_column(table: &mut RecordBatch, random: &mut RandomSource) -> String {
    let schema = table.schema();
    let ours = COLUMNS
        .iter()
        .filter_map(|column| schema.index_of(column).ok());
    let column = *ours.collect::<Vec<_>>().choose(random).expect("a column");
    table.remove_column(column);
    format!("column {} removed", schema.field(column).name())
}

/// Changes one of the JSON values in the rows of `table`.
fn change_texts(entity: &str, table: &mut RecordBatch, random: &mut RandomSource) -> String {
    if entity == "/events" && chance(random, 25) {
        return change_rows(table, random);
    }
    let row = random.random_range(0..table.num_rows());
    let how = edit_json(table, row, |value| change_json(value, random));
    format!("row {row}: {how}")
}

/// The JSON value in a row of `table`.
pub fn json_in(table: &RecordBatch, row: usize) -> Value {
    let cells = table.column_by_name("json").expect("JSON");
    let cell = cells.as_list::<i32>().value(row);
    serde_json::from_str(cell.as_string::<i32>().value(0)).expect("JSON")
}

/// Applies `edit` to that value.
fn edit_json<T>(table: &mut RecordBatch, row: usize, edit: impl FnOnce(&mut Value) -> T) -> T {
    let mut value = json_in(table, row);
    let outcome = edit(&mut value);
    set_text(table, "json", row, value.to_string());
    outcome
}
