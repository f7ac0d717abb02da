//! Files that were altered on purpose: what they hold is damage, or is found.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use ratelab::{ClockKind, Command, Event, EventKind, Knob, Speed, Time};
use ratelab_cart_pole::CartPole;
use rerun::external::arrow::{
    array::{Array, AsArray, DurationNanosecondArray},
    datatypes::DurationNanosecondType,
};
use serde_json::{Value, json};
use tempfile::TempDir;

use super::{
    altered::{alter, alter_json, empty_cell, set_number},
    folder, hz, read, record, recording, replay, verify,
};
use crate::recording::{
    ReadError, Recording,
    schema::{RecordingEnd, RunResult, RunStatus},
};

/// A run of a second with a fall, in a file of its own.
fn fall(folder: &TempDir) -> PathBuf {
    let path = folder.path().join("fall.rrd");
    let _ = fs::remove_file(&path);
    let config = CartPole::config("control-hz 5").expect("a knob");
    record(&config, &path).0.expect("no fault");
    path
}

/// What is wrong with the file, which must be shown as far as it is good.
fn defect_of(path: &Path) -> String {
    let recording = read(path);
    let mut replay = replay(recording.clone());
    assert!(
        replay.begins() <= recording.until,
        "it ends before it begins"
    );
    replay.advance_to(Time::MAX);
    let _ = verify(&recording);
    recording.defect().expect("a defect")
}

#[test]
fn a_stamp_before_the_beginning_is_damage() {
    let folder = folder();
    for entity in ["/topics/obs", "/nodes/sensor"] {
        let path = fall(&folder);
        alter(&path, entity, "run_time", |column| {
            let times = column.as_primitive::<DurationNanosecondType>().values();
            let mut times = times.to_vec();
            times[0] = -1;
            Arc::new(DurationNanosecondArray::from(times))
        });
        let defect = defect_of(&path);
        assert!(
            defect.contains("good up to 0.000 s only: a row in it is damaged"),
            "{defect}"
        );
    }
}

#[test]
fn an_empty_cell_is_damage_and_not_zero() {
    let folder = folder();
    let cells = [
        ("/topics/obs", "seq"),
        ("/topics/obs", "dropped"),
        ("/topics/action", "origin_ns"),
        ("/nodes/policy", "tick"),
        ("/nodes/policy", "overruns"),
        ("/nodes/policy", "took_ns"),
        ("/events", "json"),
    ];
    for (entity, column) in cells {
        let path = fall(&folder);
        alter(&path, entity, column, |column| empty_cell(column, 0));
        let defect = defect_of(&path);
        assert!(
            defect.contains("a row in it is damaged"),
            "{entity} {column}: {defect}"
        );
    }
}

#[test]
fn rows_that_do_not_follow_each_other_are_damage() {
    let folder = folder();
    let lies = [
        ("/topics/obs", "seq", 5, 2),
        ("/topics/obs", "dropped", 5, 1 << 60),
        ("/nodes/sensor", "tick", 5, 1 << 60),
        ("/nodes/sensor", "overruns", 5, 1 << 60),
    ];
    for (entity, column, row, number) in lies {
        let path = fall(&folder);
        alter(&path, entity, column, |column| {
            set_number(column, row, number)
        });
        let defect = defect_of(&path);
        assert!(
            defect.contains("a row in it is damaged"),
            "{entity} {column}: {defect}"
        );
    }
}

#[test]
fn a_graph_of_thousands_of_ends_is_refused() {
    let folder = folder();
    let readers = |readers: Vec<usize>| {
        let path = fall(&folder);
        alter_json(&path, "__properties/origin", |origin| {
            origin["shape"]["topics"][0]["readers"] = json!(readers);
        });
        Recording::read(&path).expect_err("refused").to_string()
    };
    let error = readers(vec![1; 20_000]);
    assert!(error.contains("up to 256 are read"), "{error}");
    for ends in [vec![1, 1], vec![3]] {
        let error = readers(ends);
        assert!(
            error.contains("graph in this recording is damaged"),
            "{error}"
        );
    }
}

#[test]
fn a_recording_cannot_begin_later_than_its_ticks_have_it() {
    let folder = folder();
    let path = fall(&folder);
    let late = 1_000_000_000_000_000_000_i64;
    for entity in [
        "/topics/obs",
        "/topics/action",
        "/topics/state",
        "/nodes/sensor",
        "/nodes/policy",
        "/nodes/actuator",
    ] {
        alter(&path, entity, "run_time", |column| {
            Arc::new(DurationNanosecondArray::from(vec![late; column.len()]))
        });
    }
    alter_json(&path, "/end", |end| end["at"] = json!(late));
    alter_json(&path, "__properties/origin", |origin| {
        origin["config"]["end"] = json!(u64::MAX);
    });
    let defect = defect_of(&path);
    assert!(defect.contains("good up to 0.000 s"), "{defect}");
    let error = verify(&read(&path))
        .expect_err("nothing is left")
        .to_string();
    assert!(error.contains("nothing in it to verify"), "{error}");
}

#[test]
fn an_end_that_its_rows_do_not_support_is_damage() {
    let folder = folder();
    type Lie = fn(&mut Value);
    let lies: [(&str, Lie); 5] = [
        ("a recording of years", |end| {
            end["at"] = json!(u64::MAX / 2)
        }),
        ("an end before the last row", |end| end["at"] = json!(1)),
        ("a run longer than itself", |end| {
            end["end"]["Ended"]["sim_time"] = json!(99_000_000_000_u64);
        }),
        ("a verdict after the end", |end| {
            end["end"]["Ended"]["verdict"]["at"] = json!(99_000_000_000_u64);
        }),
        ("more of the wall's time than there is", |end| {
            end["end"]["Ended"]["wall_time"]["secs"] = json!(1_000_000_000_000_000_000_u64);
        }),
    ];
    for (what, lie) in lies {
        let path = fall(&folder);
        alter_json(&path, "/end", lie);
        let defect = defect_of(&path);
        assert!(
            defect.contains("good up to 0.840 s only: a row"),
            "{what}: {defect}"
        );
    }
    let path = fall(&folder);
    alter_json(&path, "/end", |end| {
        end["lost"] = json!(1_000_000_000_000_u64)
    });
    assert!(defect_of(&path).contains("messages are missing"));
}

#[test]
fn an_end_that_cannot_be_read_is_no_missing_end() {
    let folder = folder();
    let path = fall(&folder);
    alter_json(&path, "/end", |end| end["lost"] = json!(-1));
    let error = Recording::read(&path).expect_err("nothing else says what is whole");
    assert!(matches!(error, ReadError::Foreign { .. }), "{error}");
}

/// What `verify` says of `recording` after `lie`.
fn found(recording: &Recording, lie: impl FnOnce(&mut Recording)) -> String {
    let mut altered = recording.clone();
    lie(&mut altered);
    verify(&altered).expect_err("a lie").to_string()
}

fn outcome(recording: &mut Recording) -> &mut RecordingEnd {
    recording.outcome.as_mut().expect("an end")
}

#[test]
fn every_part_of_the_end_is_compared() {
    let folder = folder();
    let fall = read(&fall(&folder));
    verify(&fall).expect("identical");
    let end = |lie: fn(&mut RunResult)| {
        found(&fall, |recording| match &mut outcome(recording).end {
            RunStatus::Ended(end) => lie(end),
            other => panic!("{other:?}"),
        })
    };
    let tick = Time::TICK;
    let error = end(|end| end.sim_time = end.sim_time + Time::TICK);
    assert!(error.contains("run time at the end"), "{error}");
    let error = end(|end| {
        let angle = end.finals.get_mut("final_pole_angle");
        let angle = angle.and_then(Option::as_mut).expect("a figure");
        *angle = f64::from_bits(angle.to_bits() ^ 1);
    });
    assert!(error.contains("figures of the last state"), "{error}");
    let error = end(|end| end.finals.clear());
    assert!(error.contains("figures of the last state"), "{error}");
    let error = end(|end| end.verdict.name = "balanced".to_owned());
    assert!(error.contains("recorded balanced"), "{error}");
    let error = end(|end| end.verdict.at = end.verdict.at + Time::TICK);
    assert!(error.contains("time of the verdict"), "{error}");
    let error = found(&fall, |r| outcome(r).at = outcome(r).at + tick);
    assert!(error.contains("run time at the end"), "{error}");
    let error = found(&fall, |r| outcome(r).clock = ClockKind::Real);
    assert!(error.contains("the clock at the end"), "{error}");
    let error = found(&fall, |r| outcome(r).lost = 1);
    assert!(
        error.contains("too fast: recorded 1, computed 0"),
        "{error}"
    );
    let error = found(&fall, |r| {
        outcome(r).dropped.as_mut().expect("known")[1] += 1;
    });
    assert!(error.contains("/action dropped in all"), "{error}");
    // Older files do not know it.
    let mut older = fall.clone();
    outcome(&mut older).dropped = None;
    verify(&older).expect("identical");
}

#[test]
fn the_graph_is_compared() {
    let folder = folder();
    let fall = read(&fall(&folder));
    let error = found(&fall, |r| r.origin.topology.nodes[2].priority = 0);
    assert!(error.contains("node 2 of the graph"), "{error}");
    let error = found(&fall, |r| {
        r.origin.topology.nodes[0].hz = "51".parse().expect("a rate")
    });
    assert!(error.contains("sensor at 51 Hz"), "{error}");
    let error = found(&fall, |r| {
        r.origin.topology.nodes[0].meters.push("x".to_owned())
    });
    assert!(error.contains("node 0 of the graph"), "{error}");
    let error = found(&fall, |r| r.origin.topology.topics[2].readers.push(0));
    assert!(error.contains("topic 2 of the graph"), "{error}");
    let error = found(&fall, |r| r.origin.topology.topics[0].publishers.clear());
    assert!(error.contains("topic 0 of the graph"), "{error}");
    let error = found(&fall, |r| {
        r.origin.topology.topics[0].depth = "9".parse().expect("a depth");
    });
    assert!(error.contains("/obs depth 9"), "{error}");
}

#[test]
fn events_that_did_not_happen_are_found() {
    let folder = folder();
    let original = recording(&folder);
    let happened = |at: u64, what: EventKind| {
        let at = Time::from_nanos(at);
        found(&original, |recording| {
            recording.events.push(Event { at, what });
            recording.events.sort_by_key(|event| event.at);
        })
    };
    let applied = |command, was: Option<&str>| EventKind::Applied {
        command,
        was: was.map(str::to_owned),
    };
    let refused = |command| EventKind::Refused {
        command,
        reason: "no".to_owned(),
    };
    let node = "sensor".to_owned();
    let cause = "smoke".to_owned();
    let hz = hz(5.0);
    let lies = [
        EventKind::Ended { node: node.clone() },
        EventKind::Faulted {
            node: node.clone(),
            cause,
        },
        refused(Command::Set(Knob::Rate { node, hz })),
        refused(Command::HandOver(ClockKind::Real)),
        refused(Command::Pause),
        applied(Command::HandOver(ClockKind::Virtual), None),
        applied(Command::Speed(Speed::REAL_TIME), Some("4×")),
        applied(Command::Pause, Some("something")),
    ];
    for lie in lies {
        let error = happened(500_000_000, lie.clone());
        assert!(error.contains("differs at 0.500 s"), "{lie:?}: {error}");
    }
    let error = found(&original, |recording| {
        for at in [2_000_000_000, 1_000_000_000] {
            let what = applied(Command::Pause, None);
            recording.events.push(Event {
                at: Time::from_nanos(at),
                what,
            });
        }
    });
    assert!(error.contains("an event"), "{error}");
    let error = found(&original, |recording| {
        if let EventKind::Applied { was, .. } = &mut recording.events[0].what {
            *was = Some("49 Hz".to_owned());
        }
    });
    assert!(error.contains("was 49 Hz"), "{error}");
}

#[test]
fn a_knob_that_was_given_was_turned() {
    let folder = folder();
    let original = recording(&folder);
    let knob = |line: &str| {
        let knobs = CartPole::KNOBS.parse_timed(line).expect("a knob");
        knobs.into_iter().next().expect("one")
    };
    let error = found(&original, |recording| {
        recording.origin.config.knobs[0] = knob("1.5 control-hz 11");
    });
    assert!(error.contains("a knob that was given"), "{error}");
    let error = found(&original, |recording| {
        let knobs = &mut recording.origin.config.knobs;
        knobs.push(knob("2 sensor-hz 20"));
    });
    assert!(error.contains("sensor at 20 Hz"), "{error}");
    // What the run did not come to is no lie.
    let mut late = original.clone();
    late.origin.config.knobs.push(knob("9 sensor-hz 20"));
    verify(&late).expect("identical");
}
