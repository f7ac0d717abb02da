//! Lies with a digest that was made again, as everybody can who reads the source: what verifying a
//! recording finds by itself, and what it must believe.

use std::{fs, path::Path, sync::Arc};

use ratelab::{Derived, Head, MessageId, Time};
use ratelab_experiment::{Config, Experiment};
use ratelab_metrics::TickRecord;
use ratelab_recording::{
    Recording, RecordingEnd, VerifyError,
    rrd::schema::{END, EVENTS, JSON, ORIGIN},
};
use ratelab_system::{System, graph_file::GraphFile};
use rerun::{
    ComponentIdentifier,
    external::{
        arrow::array::{Array, ArrayRef, AsArray},
        re_log_encoding::{DecoderApp, Encoder},
    },
    log::{Chunk, LogMsg},
};
use serde_json::{Value, json};
use xxhash_rust::xxh3::Xxh3;

use super::{
    altered::{alter, alter_json, empty_cell, set_number},
    assert_has, falling, file, read, record, record_run,
    table::rows,
    turned, verify, verify_with,
};

/// The messages in a file.
fn messages(path: &Path) -> Vec<LogMsg> {
    let bytes = fs::read(path).expect("read");
    let messages = DecoderApp::decode_eager(&*bytes).expect("whole");
    messages.map(|message| message.expect("whole")).collect()
}

/// The texts of an entity whose path ends with `entity`.
fn texts(messages: &[LogMsg], entity: &str) -> Vec<String> {
    let tables = messages.iter().filter_map(|message| match message {
        LogMsg::ArrowMsg(_, data) => Some(&data.batch),
        _ => None,
    });
    let of_it = tables.filter(|table| {
        let mut names = table.schema_ref().metadata().values();
        names.any(|name| name.starts_with('/') && name.ends_with(entity))
    });
    let columns = of_it.filter_map(|table| table.column_by_name(JSON));
    columns.flat_map(texts_of).collect()
}

/// The texts in the rows of a column that have one.
fn texts_of(column: &ArrayRef) -> Vec<String> {
    let cells = column
        .as_list::<i32>()
        .iter()
        .flatten()
        .filter(|cell| !cell.is_empty());
    cells
        .map(|cell| cell.as_string::<i32>().value(0).to_owned())
        .collect()
}

/// A second implementation of the digest.
#[derive(Default)]
struct Sealer(Xxh3);

impl Sealer {
    fn numbers(&mut self, numbers: impl IntoIterator<Item = u64>) {
        for number in numbers {
            self.0.update(&number.to_le_bytes());
        }
    }

    /// Numbers that may be missing.
    fn rare(&mut self, numbers: [Option<u64>; 2]) {
        for number in numbers {
            self.numbers([number.is_some().into(), number.unwrap_or_default()]);
        }
    }

    fn message(&mut self, head: &Head, numbers: &[f64]) {
        let Head {
            seq,
            at,
            stamp,
            dropped,
            origin,
            arrives,
            by,
            from,
        } = *head;
        self.numbers([seq, at.as_nanos(), stamp.as_nanos(), dropped]);
        self.rare([origin, arrives].map(|time| time.map(Time::as_nanos)));
        self.rare([
            by.map(|by| by.node as u64),
            by.map(|by| by.number.wrapping_sub(seq)),
        ]);
        self.rare([
            from.message().map(|from| from.topic as u64),
            match from {
                Derived::Reads => None,
                Derived::Message(from) => Some(from.seq),
                Derived::Nothing => Some(0),
            },
        ]);
        self.numbers(numbers.iter().map(|number| number.to_bits()));
    }

    fn tick(&mut self, tick: &TickRecord) {
        self.numbers([tick.number, tick.at.as_nanos(), tick.overruns]);
        let durations = [tick.lateness, tick.took];
        self.rare(durations.map(|duration| duration.map(|time| time.as_nanos() as u64)));
        let push = tick.push.map(|push| [push.at, push.sensed]);
        self.rare([0, 1].map(|at| push.map(|push| push[at].as_nanos())));
        let completed = tick.causes.completed.map(|topic| topic as u64);
        self.numbers([completed.is_some().into(), completed.unwrap_or_default()]);
        let reads = &tick.causes.reads;
        self.numbers([4 * reads.len() as u64]);
        for read in reads {
            let MessageId { topic, seq } = read.message;
            let apart = seq.wrapping_sub(tick.number);
            self.numbers([topic as u64, apart, read.reader as u64, read.newest - seq]);
        }
    }
}

/// The digest of the content of a file.
fn digest(path: &Path) -> u64 {
    let (messages, recording) = (messages(path), read(path));
    let text = |entity: &str| texts(&messages, entity).pop().expect(entity);
    let (mut origin, mut events) = (Sealer::default(), Sealer::default());
    origin
        .0
        .update(text(&format!("__properties/{ORIGIN}")).as_bytes());
    let all = texts(&messages, EVENTS);
    all.iter()
        .for_each(|event| events.0.update(format!("{event}\n").as_bytes()));
    let topics = recording.topics.iter().map(|rows| {
        let mut sealer = Sealer::default();
        rows.iter()
            .for_each(|(head, numbers)| sealer.message(head, numbers));
        sealer
    });
    let nodes = recording.ticks.iter().map(|ticks| {
        let mut sealer = Sealer::default();
        ticks.iter().for_each(|tick| sealer.tick(tick));
        sealer
    });
    let mut whole = Sealer::default();
    let parts = [origin, events].into_iter().chain(topics).chain(nodes);
    whole.numbers(parts.map(|part| part.0.digest()));
    let end: RecordingEnd = serde_json::from_str(&text(END)).expect("an end");
    let end = RecordingEnd {
        digest: None,
        ..end
    };
    whole
        .0
        .update(serde_json::to_string(&end).expect("JSON").as_bytes());
    whole.0.digest()
}

/// Gives a file the digest of its content.
fn seal(path: &Path) {
    let digest = digest(path);
    alter_json(path, END, |end| end["digest"] = json!(digest));
}

/// A file of a run with a fall, and one of a run with knobs that were turned.
fn fall_and_turned() -> [(tempfile::TempDir, std::path::PathBuf); 2] {
    [falling(), turned()].map(|config| {
        let (folder, path) = file("run.rrd");
        record(&config, &path).0.expect("no fault");
        (folder, path)
    })
}

#[test]
fn the_digest_of_the_test_is_that_of_the_recorder() {
    for (_folder, path) in fall_and_turned() {
        let recorded = read(&path).outcome.and_then(|end| end.digest);
        assert_eq!(recorded, Some(digest(&path)));
    }
}

/// Changes a value of the description or of the end in the file at `path`; `null` removes it.
fn lie(path: &Path, pointer: &str, value: &Value) {
    let (entity, pointer) = pointer.split_at(pointer.find('/').expect("a part"));
    let entity = match entity {
        "end" => END.to_owned(),
        _ => format!("__properties/{ORIGIN}"),
    };
    alter_json(path, &entity, |json| {
        let (parent, name) = pointer.rsplit_once('/').expect("a pointer");
        let parent = json.pointer_mut(parent).expect(pointer);
        match parent {
            Value::Object(fields) if value.is_null() => drop(fields.remove(name)),
            Value::Array(items) if value.is_null() => {
                items.remove(name.parse().expect("an index"));
            }
            Value::Object(fields) => drop(fields.insert(name.to_owned(), value.clone())),
            Value::Array(items) => items[name.parse::<usize>().expect("an index")] = value.clone(),
            _ => panic!("{pointer}"),
        }
    });
}

#[test]
fn a_lie_about_what_comes_again_is_found_with_any_digest() {
    // Which file, a value, a lie about it (null removes it), and what is said.
    for [of, field, value, why] in rows(
        r#"
        fall | end/end/Ended/sim_time         | 839999999  | run time at the end
        fall | end/end/Ended/steps            | 9          | the end of the run
        fall | end/end/Ended/finals           | {}         | figures of the last state
        fall | end/end/Ended/finals/final_pole_angle | -0.2 | figures of the last state
        fall | end/end/Ended/verdict/name     | "balanced" | recorded balanced
        fall | end/end/Ended/verdict/at       | 839999999  | time of the verdict
        fall | end/clock                      | "Real"     | the clock at the end
        fall | end/dropped/1                  | 9          | /action dropped in all
        fall | origin/config/seed             | 7          | recorded
        fall | origin/config/setup/0          | null       | differs
        fall | origin/config/world            | {"own":{"step_ms":1}} | differs
        fall | origin/shape/nodes/2/priority  | 0          | node 2 of the graph
        fall | origin/shape/nodes/0/hz        | 51.0       | sensor at 51 Hz
        fall | origin/shape/topics/0/depth    | 9          | /obs depth 9
        knobs | origin/config/knobs/0/at      | 1400000000 | a knob that was given
        knobs | origin/config/seed            | 5          | recorded
        "#,
    ) {
        let [fall, turned] = fall_and_turned();
        let (_folder, path) = if of == "fall" { fall } else { turned };
        lie(&path, &field, &serde_json::from_str(&value).expect(&value));
        seal(&path);
        let error = verify(&read(&path)).expect_err(&field).to_string();
        assert!(error.contains(&why), "{field} {value}: {error}");
    }
}

#[test]
fn a_row_or_an_event_that_did_not_come_is_found_with_any_digest() {
    type Lie = fn(&ArrayRef) -> ArrayRef;
    let lies: [(&str, &str, Lie, &str); 5] = [
        (
            "/topics/obs",
            "dropped",
            |cells| set_number(cells, 60, 7),
            "/obs message",
        ),
        (
            "/topics/action",
            "origin_ns",
            |cells| set_number(cells, 5, 7),
            "/action message 5",
        ),
        (
            "/topics/obs",
            "Scalars:scalars",
            cells_exchanged,
            "/obs message 3",
        ),
        (
            "/nodes/actuator",
            "overruns",
            |cells| set_number(cells, 199, 1),
            "actuator tick",
        ),
        (EVENTS, JSON, |cells| empty_cell(cells, 0), "an event"),
    ];
    for (entity, column, how, why) in lies {
        let [_, (_folder, path)] = fall_and_turned();
        alter(&path, entity, column, |cells| how(cells));
        seal(&path);
        let recording = read(&path);
        let said = match verify(&recording) {
            Err(error) => error.to_string(),
            Ok(_) => recording
                .defect()
                .expect("neither a difference nor a defect"),
        };
        let is_damage = said.contains("a row in it is damaged");
        assert!(said.contains(why) || is_damage, "{entity} {column}: {said}");
    }
}

/// The third and the fourth row exchanged.
fn cells_exchanged(cells: &ArrayRef) -> ArrayRef {
    super::altered::exchange(cells, [3, 4])
}

#[test]
fn what_does_not_come_of_a_run_is_believed_with_a_new_digest_and_found_without() {
    // A field, a lie about it, and whether it is about the software.
    for [field, value, of_software] in rows(
        r#"
        end/end/Ended/wall_time   | {"secs":9,"nanos":0}  | no
        origin/config/knobs       | []                    | no
        origin/engine             | "MuJoCo 3.17.0x"      | yes
        origin/platform           | "riscv64-linux"       | yes
        origin/ratelab            | "9.9.9"               | yes
        "#,
    ) {
        let [_, (_folder, path)] = fall_and_turned();
        let value: Value = serde_json::from_str(&value).expect(&value);
        lie(&path, &field, &value);
        let error = verify(&read(&path)).expect_err(&field);
        assert!(matches!(error, VerifyError::Altered), "{field}: {error}");
        seal(&path);
        let identical = verify(&read(&path)).expect(&field).to_string();
        let named = identical.contains("the file says that ratelab");
        assert_eq!(named, of_software == "yes", "{field}: {identical}");
    }
}

#[test]
fn a_file_without_a_digest_proves_nothing() {
    for (_folder, path) in fall_and_turned() {
        lie(&path, "end/digest", &Value::Null);
        let error = verify(&read(&path)).expect_err("altered");
        assert!(matches!(error, VerifyError::Altered), "{error}");
        lie(&path, "origin/digest", &Value::Null);
        let error = verify(&read(&path)).expect_err("unproven").to_string();
        assert_has(&error, "nothing else is proven: this file has no digest");
    }
}

/// A graph with a cost that its file sets.
const GRAPH: &str = r#"
    name = "robot"
    [node.camera]
    rate = 30
    takes = 20
    publishes = ["/image"]
    [node.control]
    rate = 10
    takes = 5
    reads = ["/image"]
"#;

#[test]
fn a_setting_of_the_graph_file_that_a_recording_lacks_is_found() {
    let system: Arc<dyn System> = {
        let graph = GraphFile::parse(GRAPH).expect("a graph");
        Arc::new(graph.system(&[]).expect("a system"))
    };
    let (_folder, path) = file("graph.rrd");
    let experiment = Experiment::new(system.clone(), &Config::default()).expect("a run");
    record_run(experiment, &path).0.expect("no fault");
    let settings = read(&path).origin.config.setup.iter().count();
    assert!(settings > 1, "{settings} settings");
    for index in 0..settings {
        let (_folder, copy) = file("copy.rrd");
        fs::copy(&path, &copy).expect("copied");
        lie(&copy, &format!("origin/config/setup/{index}"), &Value::Null);
        seal(&copy);
        let error = verify_with(&read(&copy), &system)
            .expect_err("a lie")
            .to_string();
        assert_has(&error, "a setting: recorded none, computed");
    }
}

/// Writes the file at `path` with all chunks of an entity as one, as tools for rerun's files
/// merge them: rows of one lack the columns of the other.
fn merge(path: &Path, entity: &str) {
    let mut kept = Vec::new();
    let mut merged: Option<(usize, Chunk)> = None;
    for message in messages(path) {
        let chunk = match &message {
            LogMsg::ArrowMsg(store, data) if store.is_recording() => {
                Chunk::from_arrow_msg(data).ok()
            }
            _ => None,
        };
        let of_it =
            chunk.filter(|chunk| chunk.entity_path().to_string() == entity && !chunk.is_static());
        match (of_it, &mut merged) {
            (None, _) => kept.push(message),
            (Some(chunk), Some((_, before))) => {
                *before = Chunk::concat_and_sort(before, &chunk).expect("one chunk");
            }
            (Some(chunk), None) => {
                merged = Some((kept.len(), chunk));
                kept.push(message);
            }
        }
    }
    let (place, chunk) = merged.expect(entity);
    if let LogMsg::ArrowMsg(_, data) = &mut kept[place] {
        *data = chunk.to_arrow_msg().expect("a table");
    }
    let bytes = Encoder::encode(kept.into_iter().map(Ok)).expect("encoded");
    fs::write(path, bytes).expect("written");
}

#[test]
fn a_file_whose_chunks_were_merged_by_another_tool_is_whole() {
    for (_folder, path) in fall_and_turned() {
        let before = read(&path);
        merge(&path, EVENTS);
        let merged: Recording = read(&path);
        assert_eq!(merged.defect(), None);
        assert_eq!(merged.events, before.events);
        verify(&merged).expect("identical");
    }
}

/// Writes the file at `path` with a column of each entity in chunks of its own, as tools for
/// rerun's files keep wide columns.
fn split(path: &Path, column: &str) {
    let mut found = 0;
    let parts = messages(path).into_iter().flat_map(|message| {
        let LogMsg::ArrowMsg(store, data) = &message else {
            return vec![message];
        };
        let chunk = Chunk::from_arrow_msg(data).expect("a chunk");
        let names: Vec<_> = chunk.components_identifiers().collect();
        let (wide, narrow): (Vec<_>, Vec<_>) =
            names.into_iter().partition(|name| name.as_str() == column);
        let is_tick = chunk.entity_path().to_string().starts_with("/nodes/");
        if wide.is_empty() || narrow.is_empty() || chunk.is_static() || is_tick {
            return vec![message];
        }
        found += 1;
        let part = |names: &[ComponentIdentifier]| {
            let part = chunk.components_sliced(names);
            LogMsg::ArrowMsg(store.clone(), part.to_arrow_msg().expect("a table"))
        };
        vec![part(&wide), part(&narrow)]
    });
    let bytes = Encoder::encode(parts.map(Ok)).expect("encoded");
    assert!(found > 0, "no {column}");
    fs::write(path, bytes).expect("written");
}

#[test]
fn a_file_whose_wide_columns_another_tool_keeps_apart_is_whole() {
    for (config, column) in [
        (turned(), "Scalars:scalars"),
        (super::real(super::ms(300)), "bytes"),
    ] {
        let (_folder, path) = file("run.rrd");
        record(&config, &path).0.expect("no fault");
        let before = read(&path);
        split(&path, column);
        let parted = read(&path);
        assert_eq!(parted.defect(), None, "{column}");
        // As texts, in which a number that is missing (NaN) is like another.
        let [parted_run, run] = [&parted, &before].map(|file| format!("{:?}", file.run));
        assert_eq!(parted_run, run, "{column}");
        verify(&parted).unwrap_or_else(|error| panic!("{column}: {error}"));
    }
}
