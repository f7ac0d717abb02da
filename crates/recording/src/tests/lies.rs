//! Files that were altered on purpose: what they hold is damage, or is found.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use ratelab::{ClockKind, Command, Event, EventKind, Knob, Speed, Time};
use ratelab_cart_pole::CartPole;
use rerun::external::arrow::{
    array::{Array, ArrayRef, AsArray, DurationNanosecondArray},
    datatypes::DurationNanosecondType,
};
use serde_json::json;
use tempfile::TempDir;

use super::{
    altered::{alter, alter_json, empty_cell, set_number},
    assert_has, falling, folder, found, hz, ms, read, record, recorded, replayed, turned, verify,
};
use crate::{
    ReadError, Recording,
    schema::{RecordingEnd, RunResult, RunStatus},
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
            let times = column.as_primitive::<DurationNanosecondType>().values();
            let mut times = times.to_vec();
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
        ("/events", "json", None),
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
fn a_graph_of_thousands_of_ends_is_refused() {
    let folder = folder();
    for (readers, why) in [
        (vec![1; 20_000], "up to 256 are read"),
        (vec![1, 1], "graph in this recording is damaged"),
        (vec![3], "graph in this recording is damaged"),
    ] {
        let path = fall(&folder);
        alter_json(&path, "__properties/origin", |origin| {
            origin["shape"]["topics"][0]["readers"] = json!(readers);
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

fn outcome(recording: &mut Recording) -> &mut RecordingEnd {
    recording.outcome.as_mut().expect("an end")
}

fn result(recording: &mut Recording) -> &mut RunResult {
    match &mut outcome(recording).end {
        RunStatus::Ended(end) => end,
        other => panic!("{other:?}"),
    }
}

/// Adds the least there is.
fn later(time: &mut Time) {
    *time = *time + Time::RESOLUTION;
}

/// What a verification says of a lie.
type Lies<'l> = &'l [(&'l str, fn(&mut Recording))];

/// Checks that each of `lies` about a fall is found.
fn assert_found(lies: Lies<'_>) {
    let (fall, _) = recorded(&falling());
    verify(&fall).expect("identical");
    for (why, lie) in lies {
        assert_has(&found(&fall, lie), why);
    }
}

#[test]
fn every_part_of_the_end_is_compared() {
    assert_found(&[
        ("run time at the end", |r| later(&mut result(r).sim_time)),
        ("the end of the run", |r| result(r).steps += 1),
        ("figures of the last state", |r| {
            let angle = result(r).finals.get_mut("final_pole_angle");
            let angle = angle.and_then(Option::as_mut).expect("a figure");
            *angle = f64::from_bits(angle.to_bits() ^ 1);
        }),
        ("figures of the last state", |r| result(r).finals.clear()),
        ("recorded balanced", |r| {
            result(r).verdict.name = "balanced".to_owned();
        }),
        ("time of the verdict", |r| later(&mut result(r).verdict.at)),
        ("run time at the end", |r| later(&mut outcome(r).at)),
        ("the clock at the end", |r| {
            outcome(r).clock = ClockKind::Real
        }),
        ("too fast: recorded 1, computed 0", |r| outcome(r).lost = 1),
        ("/action dropped in all", |r| {
            outcome(r).dropped.as_mut().expect("known")[1] += 1;
        }),
    ]);
    // Older files do not know what was dropped.
    let (mut older, _) = recorded(&falling());
    outcome(&mut older).dropped = None;
    verify(&older).expect("identical");
}

#[test]
fn the_graph_is_compared() {
    assert_found(&[
        ("node 2 of the graph", |r| {
            r.origin.topology.nodes[2].priority = 0
        }),
        ("sensor at 51 Hz", |r| {
            r.origin.topology.nodes[0].hz = hz(51.0)
        }),
        ("node 0 of the graph", |r| {
            r.origin.topology.nodes[0].meters.push("x".to_owned());
        }),
        ("topic 2 of the graph", |r| {
            r.origin.topology.topics[2].readers.push(0);
        }),
        ("topic 0 of the graph", |r| {
            r.origin.topology.topics[0].publishers.clear();
        }),
        ("/obs depth 9", |r| {
            r.origin.topology.topics[0].depth = "9".parse().expect("a depth");
        }),
    ]);
}

#[test]
fn events_that_did_not_happen_are_found() {
    let (original, _) = recorded(&turned());
    let applied = |command, was: Option<&str>| EventKind::Applied {
        command,
        was: was.map(str::to_owned),
    };
    let refused = |command| EventKind::Refused {
        command,
        reason: "no".to_owned(),
    };
    let event = |millis: u64, what| Event {
        at: ms(millis),
        what,
    };
    let (node, cause) = ("sensor".to_owned(), "smoke".to_owned());
    let lies = [
        EventKind::Ended { node: node.clone() },
        EventKind::Faulted {
            node: node.clone(),
            cause,
        },
        refused(Command::Set(Knob::Rate { node, hz: hz(5.0) })),
        refused(Command::HandOver(ClockKind::Real)),
        refused(Command::Pause),
        applied(Command::HandOver(ClockKind::Virtual), None),
        applied(Command::Speed(Speed::REAL_TIME), Some("4×")),
        applied(Command::Pause, Some("something")),
    ];
    for lie in lies {
        let error = found(&original, |recording| {
            recording.events.push(event(500, lie.clone()));
            recording.events.sort_by_key(|event| event.at);
        });
        assert!(error.contains("differs at 0.500 s"), "{lie:?}: {error}");
    }
    let error = found(&original, |recording| {
        let pauses = [2_000, 1_000].map(|at| event(at, applied(Command::Pause, None)));
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
