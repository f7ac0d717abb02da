//! Altered recordings of the real clock: a value, a time, a turn of a thread, a field or a
//! bit of the file. A verification accepts none of them.
//!
//! An alteration counts if it changes what a verification compares. This is decided by the
//! structure of the file, without a verification: see [`compared`].

use std::{
    fs,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::Arc,
};

use rand::{Rng, seq::IndexedRandom};
use rerun::{
    external::{
        arrow::{
            array::{ArrayRef, AsArray, RecordBatch, StringArray, UInt64Array},
            datatypes::Float64Type,
        },
        re_log_encoding::DecoderApp,
    },
    log::LogMsg,
};
use tempfile::tempdir;

use crate::{
    alterations::{
        COLUMNS, change_column, change_table, change_texts, choose, entity, is_json, is_series,
        json_in,
    },
    cases::{RandomSource, run},
    program::does,
    recordings::{encode, record},
};

/// The command lines of fresh recordings, with timed knobs in [`KNOBS`].
const RUNS: [&str; 2] = [
    "run --duration-s 0.6 --control-hz 80 --knobs run.knobs",
    "run --duration-s 0.6 --world own --takes policy=12..30 --queue-depth 3 \
     --knob 'link /obs delay:4..9,loss:0.2' --knobs run.knobs",
];

const KNOBS: &str = "0.15 control-hz 55\n0.3 queue-depth 2\n0.4 policy lqr\n";

/// The log of the threads, and its columns.
const THREADS: &str = "/threads";
const OF_THREADS: [&str; 4] = ["piece", "thread", "bytes", "digest"];

/// Size of the headers of a file and of each message in it.
const FILE_HEADER: usize = 12;
const HEADER: usize = 16;

fn is_threads(message: &LogMsg) -> bool {
    entity(message).is_some_and(|(entity, _)| entity == THREADS)
}

/// What a verification compares in a file, by entity and column.
pub fn compared(messages: &[LogMsg]) -> Vec<(String, String, ArrayRef)> {
    let mut all = Vec::new();
    for message in messages {
        let Some((entity, table)) = entity(message) else {
            continue;
        };
        let columns = match (is_series(message), is_json(message), is_threads(message)) {
            (true, ..) => COLUMNS.to_vec(),
            (_, true, _) => vec!["json"],
            (.., true) => OF_THREADS.to_vec(),
            _ => continue,
        };
        for column in columns {
            let Some(cells) = table.column_by_name(column) else {
                continue;
            };
            let content = match column {
                "json" => claims(table),
                "Scalars:scalars" if entity.starts_with("/nodes/") => lateness(cells),
                _ => cells.clone(),
            };
            all.push((entity.to_owned(), column.to_owned(), content));
        }
    }
    all
}

/// The lateness of ticks to the nanosecond, as it is read.
fn lateness(cells: &ArrayRef) -> ArrayRef {
    let micros = cells.as_list::<i32>().values().clone();
    let nanos = micros.as_primitive::<Float64Type>().iter();
    let nanos = nanos.map(|micros| micros.map(|micros| (micros * 1e3).round().to_bits()));
    Arc::new(UInt64Array::from_iter(nanos))
}

/// The JSON in the rows of a table.
fn claims(table: &RecordBatch) -> ArrayRef {
    let texts = (0..table.num_rows()).map(|row| json_in(table, row).to_string());
    Arc::new(StringArray::from_iter_values(texts))
}

/// Changes one cell, one field or one bit of the log of the threads; describes the change.
fn alter(messages: &mut [LogMsg], random: &mut RandomSource) -> String {
    let wanted: [fn(&LogMsg) -> bool; 4] = [is_series, is_series, is_threads, is_json];
    let at = choose(messages, *wanted.choose(random).expect("one"), random);
    let message = &mut messages[at];
    let name = entity(message).expect("a table").0.to_owned();
    let (json, threads) = (is_json(message), is_threads(message));
    change_table(message, |table| match json {
        true => change_texts(&name, table, random),
        false if threads => change_column(table, &OF_THREADS, random),
        false => change_column(table, &COLUMNS, random),
    })
}

/// Changes one bit of a message with compared content in the file `bytes`.
fn damage(bytes: &mut [u8], messages: &[LogMsg], random: &mut RandomSource) -> String {
    let mut ranges = Vec::new();
    let mut at = FILE_HEADER;
    for message in messages {
        let length = bytes[at + 8..at + HEADER].try_into().expect("eight bytes");
        let content = at + HEADER..at + HEADER + u64::from_le_bytes(length) as usize;
        at = content.end;
        if is_series(message) || is_json(message) || is_threads(message) {
            ranges.push(content);
        }
    }
    let range = ranges.choose(random).expect("a message").clone();
    let (place, bit) = (random.random_range(range), random.random_range(0..8));
    bytes[place] ^= 1 << bit;
    format!("bit {bit} of byte {place}")
}

/// The messages of a file; `None` if one is unreadable.
fn readable(bytes: &[u8]) -> Option<Vec<LogMsg>> {
    let messages = DecoderApp::decode_eager(bytes).ok()?;
    messages.collect::<Result<_, _>>().ok()
}

/// A file with another content than `original`, and the description of the change.
fn altered(original: &[LogMsg], random: &mut RandomSource) -> (Vec<u8>, String) {
    let content = compared(original);
    loop {
        let (bytes, how) = if random.random_ratio(1, 4) {
            let mut bytes = encode(original);
            let how = damage(&mut bytes, original, random);
            (bytes, how)
        } else {
            let mut messages = original.to_vec();
            let how = alter(&mut messages, random);
            (encode(&messages), how)
        };
        // What arrow panics on, such as some lengths, is not the same.
        let same = catch_unwind(AssertUnwindSafe(|| {
            readable(&bytes).is_some_and(|messages| compared(&messages) == content)
        }));
        if !same.unwrap_or(false) {
            return (bytes, how);
        }
    }
}

#[test]
fn real_clock() {
    let folder = tempdir().expect("a folder");
    fs::write(folder.path().join("run.knobs"), KNOBS).expect("written");
    let originals = RUNS.map(|line| record(folder.path(), line));
    let file = folder.path().join("altered.rrd");
    let verify = || does("verify altered.rrd", folder.path());
    for original in &originals {
        fs::write(&file, encode(original)).expect("written");
        let output = verify();
        assert!(output.status.success(), "encoded again: {output:?}");
    }
    run("real_clock", 40, |random, note| {
        let original = originals.choose(random).expect("one");
        let (bytes, how) = altered(original, random);
        *note = how;
        fs::write(&file, bytes).expect("written");
        assert!(!verify().status.success(), "verify accepts it");
    });
}
