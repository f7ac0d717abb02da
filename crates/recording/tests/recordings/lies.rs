//! Files that were altered on purpose: what they hold is damage, or is found.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use ratelab::{Event, EventKind};
use ratelab_cart_pole::CartPole;
use ratelab_recording::{ReadError, Recording, RecordingEnd};
use rerun::external::arrow::{
    array::{Array, ArrayRef, AsArray, DurationNanosecondArray},
    datatypes::DurationNanosecondType,
};
use serde_json::{Value, json};
use tempfile::TempDir;

use super::{
    altered::{alter, alter_json, empty_cell, set_number},
    assert_has, falling, folder, found, ms, read, record, recorded, replayed,
    table::rows,
    turned, verify,
};

/// A run of a second with a fall, in a file of its own.
fn fall(folder: &TempDir) -> PathBuf {
    let path = folder.path().join("fall.rrd");
    let _ = fs::remove_file(&path);
    record(&falling(), &path).0.expect("no fault");
    path
}

/// What is wrong with the file, which must be shown as far as it is good.
fn defect_of(path: &Path) -> String {
    let replay = replayed(read(path));
    let recording = replay.recording();
    assert!(
        replay.begins() <= recording.until,
        "it ends before it begins"
    );
    let _ = verify(recording);
    recording.defect().expect("a defect")
}

/// What is wrong with a fall after `how` altered a column of an entity.
fn altered_fall(entity: &str, column: &str, how: impl Fn(&ArrayRef) -> ArrayRef) -> String {
    let folder = folder();
    let path = fall(&folder);
    alter(&path, entity, column, how);
    defect_of(&path)
}

#[test]
fn a_stamp_before_the_beginning_is_damage() {
    for entity in ["/topics/obs", "/nodes/sensor"] {
        let defect = altered_fall(entity, "run_time", |column| {
            let mut times = column
                .as_primitive::<DurationNanosecondType>()
                .values()
                .to_vec();
            times[0] = -1;
            Arc::new(DurationNanosecondArray::from(times))
        });
        assert_has(&defect, "good up to 0.000 s only: a row in it is damaged");
    }
}

#[test]
fn an_empty_cell_or_a_row_that_does_not_follow_the_one_before_is_damage() {
    // An empty cell, or a number in the sixth row.
    let lies = [
        ("/topics/obs", "seq", None),
        ("/topics/obs", "dropped", None),
        ("/topics/action", "origin_ns", None),
        ("/nodes/policy", "tick", None),
        ("/nodes/policy", "overruns", None),
        ("/nodes/policy", "took_ns", None),
        ("/topics/obs", "seq", Some(2)),
        ("/topics/obs", "dropped", Some(1 << 60)),
        ("/nodes/sensor", "tick", Some(1 << 60)),
        ("/nodes/sensor", "overruns", Some(1 << 60)),
    ];
    for (entity, column, number) in lies {
        let defect = altered_fall(entity, column, |cells| match number {
            None => empty_cell(cells, 0),
            Some(number) => set_number(cells, 5, number),
        });
        let damaged = defect.contains("a row in it is damaged");
        assert!(damaged, "{entity} {column} {number:?}: {defect}");
    }
}

#[test]
fn a_graph_of_thousands_of_ends_or_with_ends_that_are_not_there_is_refused() {
    let folder = folder();
    let damaged = "graph in this recording is damaged";
    for (list, key, ends, why) in [
        ("topics", "readers", vec![1; 20_000], "up to 256 are read"),
        ("topics", "readers", vec![1, 1], damaged),
        ("topics", "readers", vec![3], damaged),
        ("nodes", "triggers", vec![3], damaged),
    ] {
        let path = fall(&folder);
        alter_json(&path, "__properties/origin", |origin| {
            origin["shape"][list][0][key] = json!(ends);
        });
        let error = Recording::read(&path).expect_err("refused");
        assert_has(&error.to_string(), why);
    }
}

#[test]
fn a_recording_cannot_begin_later_than_its_ticks_have_it() {
    let folder = folder();
    let path = fall(&folder);
    let late = 1_000_000_000_000_000_000_i64;
    let topics = ["obs", "action", "state"].map(|name| format!("/topics/{name}"));
    let nodes = ["sensor", "policy", "actuator"].map(|name| format!("/nodes/{name}"));
    for entity in topics.iter().chain(&nodes) {
        alter(&path, entity, "run_time", |column| {
            Arc::new(DurationNanosecondArray::from(vec![late; column.len()]))
        });
    }
    alter_json(&path, "/end", |end| end["at"] = json!(late));
    alter_json(&path, "__properties/origin", |origin| {
        origin["config"]["end"] = json!(u64::MAX);
    });
    assert_has(&defect_of(&path), "good up to 0.000 s");
    let error = verify(&read(&path)).expect_err("nothing is left");
    assert_has(&error.to_string(), "nothing in it to verify");
}

#[test]
fn an_end_that_its_rows_do_not_support_is_damage() {
    let folder = folder();
    let [years, late] = [json!(u64::MAX / 2), json!(99_000_000_000_u64)];
    let (run, wall) = ("/end/Ended/sim_time", "/end/Ended/wall_time/secs");
    let verdict = "/end/Ended/verdict/at";
    let (rows, lacks) = ("good up to 0.840 s only: a row", "messages are missing");
    for (what, field, lie, why) in [
        ("a recording of years", "/at", &years, rows),
        ("an end before the last row", "/at", &json!(1), rows),
        ("a run longer than itself", run, &late, rows),
        ("a verdict after the end", verdict, &late, rows),
        ("more of the wall's time than there is", wall, &years, rows),
        ("many lost", "/lost", &json!(1_u64 << 40), lacks),
        ("an action more", "/messages/1", &json!(6), lacks),
    ] {
        let path = fall(&folder);
        alter_json(&path, "/end", |end| {
            *end.pointer_mut(field).expect(field) = lie.clone();
        });
        let defect = defect_of(&path);
        assert!(defect.contains(why), "{what}: {defect}");
    }
}

#[test]
fn an_end_that_cannot_be_read_is_no_missing_end() {
    let folder = folder();
    let path = fall(&folder);
    alter_json(&path, "/end", |end| end["lost"] = json!(-1));
    let error = Recording::read(&path).expect_err("nothing else says what is whole");
    assert!(matches!(error, ReadError::Foreign { .. }), "{error}");
}

/// Puts `value` into a field of the origin or the end of a recording.
fn put(recording: &mut Recording, field: &str, value: Value) {
    let mut both = json!({"origin": recording.origin, "end": recording.outcome});
    *both.pointer_mut(&format!("/{field}")).expect(field) = value;
    let [origin, end] = ["origin", "end"].map(|part| both[part].take());
    recording.origin = serde_json::from_value(origin).expect(field);
    recording.outcome = serde_json::from_value(end).expect(field);
}

#[test]
fn every_part_of_the_end_and_of_the_graph_is_compared() {
    let (fall, _) = recorded(&falling());
    verify(&fall).expect("identical");
    // A field, a lie about it, and what is said.
    for [field, lie, why] in rows(
        r#"
        end/end/Ended/sim_time            | 840000001  | run time at the end
        end/end/Ended/steps               | 9          | the end of the run
        end/end/Ended/finals              | {}         | figures of the last state
        end/end/Ended/verdict/name        | "balanced" | recorded balanced
        end/end/Ended/verdict/at          | 840000001  | time of the verdict
        end/at                            | 840000001  | run time at the end
        end/clock                         | "Real"     | the clock at the end
        end/lost                          | 1          | too fast: recorded 1, computed 0
        end/dropped/1                     | 9          | /action dropped in all
        origin/shape/nodes/2/priority     | 0          | node 2 of the graph
        origin/shape/nodes/0/hz           | 51.0       | sensor at 51 Hz
        origin/shape/nodes/0/meters       | ["x"]      | node 0 of the graph
        origin/shape/topics/2/readers     | [0]        | topic 2 of the graph
        origin/shape/topics/0/publishers  | []         | topic 0 of the graph
        origin/shape/topics/0/depth       | 9          | /obs depth 9
        "#,
    ) {
        let value = serde_json::from_str(&lie).expect(&lie);
        let error = found(&fall, |altered| put(altered, &field, value));
        assert!(error.contains(&why), "{field} {lie}: {error}");
    }
    let angle = "end/end/Ended/finals/final_pole_angle";
    let known = fall
        .outcome
        .as_ref()
        .and_then(RecordingEnd::result)
        .and_then(|end| end.finals["final_pole_angle"]);
    let next = f64::from_bits(known.expect("a figure").to_bits() ^ 1);
    let error = found(&fall, |altered| put(altered, angle, json!(next)));
    assert_has(&error, "figures of the last state");
    // Older files do not know what was dropped.
    let mut older = fall;
    put(&mut older, "end/dropped", json!(null));
    verify(&older).expect("identical");
}

#[test]
fn events_that_did_not_happen_are_found() {
    let (original, _) = recorded(&turned());
    let event = |millis: u64, what: &str| -> Event {
        let what = serde_json::from_str(what).expect(what);
        Event {
            at: ms(millis),
            what,
        }
    };
    for lie in [
        r#"{"Ended":{"node":"sensor"}}"#,
        r#"{"Faulted":{"node":"sensor","cause":"smoke"}}"#,
        r#"{"Refused":{"reason":"no","command":{"SetRate":{"node":"sensor","hz":5.0}}}}"#,
        r#"{"Refused":{"reason":"no","command":{"HandOver":"Real"}}}"#,
        r#"{"Refused":{"reason":"no","command":"Pause"}}"#,
        r#"{"Applied":{"command":{"HandOver":"Virtual"}}}"#,
        r#"{"Applied":{"command":{"Speed":{"Times":1.0}},"was":"4×"}}"#,
        r#"{"Applied":{"command":"Pause","was":"something"}}"#,
    ] {
        let error = found(&original, |recording| {
            recording.events.push(event(500, lie));
            recording.events.sort_by_key(|event| event.at);
        });
        assert!(error.contains("differs at 0.500 s"), "{lie}: {error}");
    }
    let error = found(&original, |recording| {
        let pauses = [2_000, 1_000].map(|at| event(at, r#"{"Applied":{"command":"Pause"}}"#));
        recording.events.extend(pauses);
    });
    assert_has(&error, "an event");
    let error = found(&original, |recording| {
        if let EventKind::Applied { was, .. } = &mut recording.events[0].what {
            *was = Some("49 Hz".to_owned());
        }
    });
    assert_has(&error, "was 49 Hz");
}

#[test]
fn a_knob_that_was_given_was_turned() {
    let (original, _) = recorded(&turned());
    let knob = |line: &str| {
        let knobs = CartPole::KNOBS.parse_timed(line).expect("a knob");
        knobs.into_iter().next().expect("one")
    };
    let error = found(&original, |recording| {
        recording.origin.config.knobs[0] = knob("1.5 control-hz 11");
    });
    assert_has(&error, "a knob that was given");
    let error = found(&original, |recording| {
        recording.origin.config.knobs.push(knob("2 sensor-hz 20"));
    });
    assert_has(&error, "sensor at 20 Hz");
    // What the run did not come to is no lie.
    let mut late = original.clone();
    late.origin.config.knobs.push(knob("9 sensor-hz 20"));
    verify(&late).expect("identical");
}
