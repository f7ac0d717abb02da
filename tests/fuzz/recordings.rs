//! Altered recordings: a value, a time, a row, a turn of a thread, a field or a bit of the file.
//! A verification never accepts them as identical, and any file takes little time and memory.
//!
//! An alteration counts if it changes what a verification compares. This is decided by the
//! structure of the file, without a verification: see [`compared`].

use std::{
    fs,
    panic::{AssertUnwindSafe, catch_unwind},
    path::Path,
    sync::Arc,
};

use rand::{Rng, seq::IndexedRandom};
use rerun::{
    external::{
        arrow::{
            array::{ArrayRef, AsArray, RecordBatch, StringArray, UInt64Array},
            datatypes::Float64Type,
        },
        re_log_encoding::{DecoderApp, Encoder},
    },
    log::LogMsg,
};
use tempfile::tempdir;

use crate::{
    alterations::{COLUMNS, OF_THREADS, alter, entity, is_json, is_series, is_threads, json_in},
    cases::{RandomSource, chance, pick, run},
    program::does,
    root,
};

/// Recordings to alter.
const SHIPPED: [&str; 2] = ["recordings/fall-5hz.rrd", "recordings/rescued.rrd"];

/// The command lines of fresh ones, with timed knobs in [`KNOBS`]; the first argument of some is a
/// graph file.
const RUNS: [&str; 8] = [
    "run --clock virtual --duration-s 2 --policy lqr --queue-depth 3 --control-hz 10",
    "run --clock virtual --duration-s 1 --world own --takes policy=5..40 --speed 10",
    "graphs/robot.toml run --clock virtual --duration-s 2",
    "graphs/three-servos.toml run --clock virtual --duration-s 1",
    "graphs/camera-pole.toml run --clock virtual --duration-s 2",
    "run --duration-s 0.5 --world own --takes policy=12..30",
    "run --duration-s 0.6 --control-hz 80 --knobs run.knobs",
    "run --duration-s 0.6 --world own --takes policy=12..30 --queue-depth 3 \
     --knob 'link /obs delay:4..9,loss:0.2' --knobs run.knobs",
];

const KNOBS: &str = "0.15 control-hz 55\n0.3 queue-depth 2\n0.4 policy lqr\n";

/// Size of the headers of a file and of each message in it.
const FILE_HEADER: usize = 12;
const HEADER: usize = 16;

/// The messages of a recording; `None` if one is unreadable.
fn decode(bytes: &[u8]) -> Option<Vec<LogMsg>> {
    let messages = DecoderApp::decode_eager(bytes).ok()?;
    messages.collect::<Result<_, _>>().ok()
}

/// Those in `file`.
fn read(file: &Path) -> Vec<LogMsg> {
    decode(&fs::read(file).expect("a recording")).expect("a recording")
}

/// Runs the command `line` in `folder`; the messages of its recording. A graph file in it is one
/// of the clone.
fn record(folder: &Path, line: &str) -> Vec<LogMsg> {
    let file = folder.join("recorded.rrd");
    let graphs = format!("{}/graphs/", root().display());
    let line = line.replace("graphs/", &graphs) + " --record recorded.rrd";
    // Some graphs miss their goal.
    let output = does(&line, folder);
    assert!(file.exists(), "{output:?}");
    let messages = read(&file);
    fs::remove_file(file).expect("removed");
    messages
}

/// Encodes `messages` as a file. Files that rerun itself would not index get no index.
pub fn encode(messages: &[LogMsg]) -> Vec<u8> {
    Encoder::encode(messages.iter().map(Ok)).unwrap_or_else(|_| {
        let mut encoder = Encoder::local().expect("an encoder");
        encoder.do_not_emit_footer();
        for message in messages {
            encoder.append(message).expect("encoded");
        }
        encoder.finish().expect("finished");
        encoder.into_inner().expect("a file")
    })
}

/// What a verification compares in a file, by entity and column.
fn compared(messages: &[LogMsg]) -> Vec<(String, String, ArrayRef)> {
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

/// The lateness of ticks to the nanosecond, as it is read: a NaN is like any other.
fn lateness(cells: &ArrayRef) -> ArrayRef {
    let micros = cells.as_list::<i32>().values().clone();
    let nanos = micros.as_primitive::<Float64Type>().iter();
    let bits = |nanos: f64| {
        if nanos.is_nan() {
            u64::MAX
        } else {
            nanos.to_bits()
        }
    };
    let nanos = nanos.map(|micros| micros.map(|micros| bits((micros * 1e3).round())));
    Arc::new(UInt64Array::from_iter(nanos))
}

/// The JSON in the rows of a table.
fn claims(table: &RecordBatch) -> ArrayRef {
    let texts = (0..table.num_rows()).map(|row| json_in(table, row).to_string());
    Arc::new(StringArray::from_iter_values(texts))
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

/// A file with another content than `original`, and the description of the change.
fn altered(original: &[LogMsg], random: &mut RandomSource) -> (Vec<u8>, String) {
    let content = compared(original);
    loop {
        let (bytes, how) = if chance(random, 20) {
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
            decode(&bytes).is_some_and(|messages| compared(&messages) == content)
        }));
        if !same.unwrap_or(false) {
            return (bytes, how);
        }
    }
}

#[test]
fn recordings() {
    let folder = tempdir().expect("a folder");
    fs::write(folder.path().join("run.knobs"), KNOBS).expect("written");
    let fresh = RUNS.iter().map(|line| record(folder.path(), line));
    let shipped = SHIPPED.iter().map(|name| read(&root().join(name)));
    let originals: Vec<_> = shipped.chain(fresh).collect();
    let originals: Vec<&[LogMsg]> = originals.iter().map(Vec::as_slice).collect();
    let file = folder.path().join("altered.rrd");
    let ask = |command: &str| does(&format!("{command} altered.rrd"), folder.path());
    for original in &originals {
        fs::write(&file, encode(original)).expect("written");
        let output = ask("verify");
        assert!(output.status.success(), "encoded again: {output:?}");
    }
    run("recordings", 70, |random, note| {
        let (bytes, how) = altered(pick(random, &originals), random);
        *note = how;
        fs::write(&file, bytes).expect("written");
        ask("info");
        assert!(!ask("verify").status.success(), "verify accepts it");
    });
}
