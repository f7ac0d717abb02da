//! The lanes of the timeline in a file: what the viewer draws of ticks and messages.

use std::{fs, path::Path};

use ratelab_study::experiment::Config;
use rerun::{StateChange, StateConfiguration};

use super::{file, ms, record, with_knobs};
use crate::{
    frames::Chunks,
    scene::{lanes::TIMELINE, modes::MODES},
    schema::path as entity,
    timeline::RUN_TIME,
};

/// The changes in a lane of the timeline: run time (ms) and state.
fn lane(path: &Path, kind: &str, name: &str) -> Vec<(i64, String)> {
    changes(path, &[TIMELINE, kind, name])
}

/// The changes in the lane at `place`.
fn changes(path: &Path, place: &[&str]) -> Vec<(i64, String)> {
    let bytes = fs::read(path).expect("read");
    let (lane, state) = (entity(place), StateChange::descriptor_state().component);
    let mut changes = Vec::new();
    for chunk in Chunks::new(&bytes).filter(|chunk| *chunk.entity_path() == lane) {
        let Some(times) = chunk.timelines().get(&RUN_TIME.into()) else {
            continue;
        };
        let states = chunk.iter_slices::<String>(state);
        let states = states.map(|row| row.iter().map(|text| text.as_str().to_owned()).collect());
        let times = times.times_raw().iter().map(|nanos| nanos / 1_000_000);
        changes.extend(times.zip(states));
    }
    changes
}

/// A recorded run of half a second, set up by `setup`.
fn recorded(path: &Path, setup: &str) {
    let config = Config {
        end: ms(500),
        ..with_knobs(setup, "")
    };
    record(&config, path).0.expect("no fault");
}

fn states(changes: &[(i64, &str)]) -> Vec<(i64, String)> {
    let changes = changes.iter();
    changes
        .map(|(at, state)| (*at, (*state).to_owned()))
        .collect()
}

#[test]
fn the_lane_of_a_topic_has_what_became_of_each_message() {
    let (_folder, path) = file("run.rrd");
    recorded(&path, "control-hz 5, link /action loss:1");
    let read = [
        (0, "read"),
        (20, "unread"),
        (200, "read"),
        (220, "unread"),
        (400, "read"),
        (420, "unread"),
    ];
    assert_eq!(lane(&path, "topic", "/obs"), states(&read));
    let lost = states(&[(0, "lost on the link")]);
    assert_eq!(lane(&path, "topic", "/action"), lost);
    assert_eq!(lane(&path, "topic", "/state"), [], "nobody reads it");
}

#[test]
fn the_lane_of_a_node_has_its_ticks() {
    let (_folder, path) = file("run.rrd");
    recorded(&path, "takes policy 45, sensor-hz 4");
    let policy = lane(&path, "node", "policy");
    let ticks = [(0, "overrun"), (45, ""), (60, "overrun"), (105, "")];
    assert_eq!(policy[..4], states(&ticks));
    let sensor = [
        (0, "tick without duration"),
        (1, ""),
        (250, "tick without duration"),
        (251, ""),
    ];
    let lane = lane(&path, "node", "sensor");
    assert_eq!(lane[..4], states(&sensor));
}

#[test]
fn the_lanes_of_plans_have_what_was_played_of_them() {
    let (_folder, path) = file("run.rrd");
    recorded(&path, "chunk 10, takes policy 60, control-hz 10");
    let first = [(0, "planned"), (60, "played"), (160, "planned"), (200, "")];
    assert_eq!(lane(&path, "plan", "1")[..4], states(&first));
    let second = [(100, "planned"), (160, "played"), (260, "planned")];
    assert_eq!(lane(&path, "plan", "2")[..3], states(&second));
    let third = [
        (200, "planned"),
        (260, "played"),
        (360, "planned"),
        (400, ""),
    ];
    assert_eq!(lane(&path, "plan", "3"), states(&third));
    assert_eq!(lane(&path, "plan", "4"), []);
}

#[test]
fn every_clock_rate_and_fault_has_a_row_and_every_rate_a_colour() {
    let (_folder, path) = file("run.rrd");
    let knobs = "0.1 control-hz 40\n0.2 control-hz 30\n0.3 control-hz 40\n0.35 sensor-hz 40\n\
                 0.4 crash sensor\n0.45 restart sensor";
    let config = Config {
        end: ms(500),
        ..with_knobs("", knobs)
    };
    record(&config, &path).0.expect("no fault");
    let rates = [(0, "50 Hz"), (100, "40 Hz"), (200, "30 Hz"), (300, "40 Hz")];
    let lane = [MODES, "rate", "policy"];
    assert_eq!(changes(&path, &lane), states(&rates));
    let clock = changes(&path, &[MODES, "clock"]);
    assert_eq!(clock, states(&[(0, "virtual")]));
    let faults = changes(&path, &[MODES, "state", "sensor"]);
    assert_eq!(faults, states(&[(400, "crashed"), (450, "runs")]));
    assert_eq!(changes(&path, &[MODES, "state", "policy"]), []);
    let bytes = fs::read(&path).expect("read");
    let values = StateConfiguration::descriptor_values().component;
    let looks = Chunks::new(&bytes).filter(|chunk| *chunk.entity_path() == entity(&lane));
    let named = looks.flat_map(|chunk| {
        let rows = chunk.iter_slices::<String>(values).flatten();
        rows.map(|text| text.to_string()).collect::<Vec<_>>()
    });
    // The colours of the lane are sent again with every new rate; the last ones hold.
    let named: Vec<String> = named.collect();
    assert!(
        named.ends_with(&["50 Hz", "40 Hz", "30 Hz"].map(str::to_owned)),
        "{named:?}"
    );
}
