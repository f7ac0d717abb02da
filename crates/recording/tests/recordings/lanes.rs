//! The lanes of the timeline in a file: what the viewer draws of ticks and messages.

use std::{
    path::{Path, PathBuf},
    time::Duration,
};

use ratelab::{ClockKind, NodeTopology, Time};
use ratelab_experiment::Config;
use ratelab_metrics::{TickCauses, TickRecord};
use ratelab_recording::{
    rrd::scene::{lanes::TIMELINE, signals::MODES},
    rrd::schema::path as entity,
    rrd::timeline::RUN_TIME,
};
use rerun::{StateChange, StateConfiguration};
use tempfile::TempDir;

use super::{
    chunks_of, file,
    given::{GivenRun, node},
    ms, record,
    table::rows,
    with_knobs,
};

/// The changes in the lane at `place`, such as `0 planned, 60 played`: run time (ms) and state,
/// which is `-` for none.
fn changes(path: &Path, place: &[&str]) -> String {
    let (lane, state) = (entity(place), StateChange::descriptor_state().component);
    let mut changes: Vec<String> = Vec::new();
    let chunks = chunks_of(path).into_iter();
    for chunk in chunks.filter(|chunk| *chunk.entity_path() == lane) {
        let Some(times) = chunk.timelines().get(&RUN_TIME.into()) else {
            continue;
        };
        let states = chunk.iter_slices::<String>(state).map(|row| row.concat());
        let times = times.times_raw().iter().map(|nanos| *nanos as f64 / 1e6);
        changes.extend(times.zip(states).map(|(at, state)| match &*state {
            "" => format!("{at} -"),
            state => format!("{at} {state}"),
        }));
    }
    changes.join(", ")
}

/// A run of half a second, set up by `setup` and turned by `knobs`, in a file of its own.
fn recorded(setup: &str, knobs: &str) -> (TempDir, PathBuf) {
    let (folder, path) = file("run.rrd");
    let config = Config {
        end: ms(500),
        ..with_knobs(setup, knobs)
    };
    record(&config, &path).0.expect("no fault");
    (folder, path)
}

#[test]
fn a_lane_of_the_timeline_has_what_became_of_ticks_messages_and_plans() {
    // A setup, a lane, and its changes: all, or the first.
    for [setup, lane, expected] in rows(
        "messages | topic /obs    | 0 read, 20 unread, 200 read, 220 unread, 400 read, 420 unread
         messages | topic /state  |
         messages | topic /action | 0 lost on the link
         ticks    | node policy   | 0 overrun, 45 -, 60 overrun, 105 - …
         ticks    | node sensor   | 0 tick without duration, 1 -, 250 tick without duration …
         plans    | plan 1        | 0 planned, 60 played, 160 planned, 200 - …
         plans    | plan 2        | 100 planned, 160 played, 260 planned …
         plans    | plan 3        | 200 planned, 260 played, 360 planned, 400 -
         plans    | plan 4        |",
    ) {
        let setup = match &*setup {
            "messages" => "control-hz 5, link /action loss:1",
            "ticks" => "takes policy 45, sensor-hz 4",
            _ => "chunk 10, takes policy 60, control-hz 10",
        };
        let (_folder, path) = recorded(setup, "");
        let (kind, name) = lane.split_once(' ').expect("a name");
        let found = changes(&path, &[TIMELINE, kind, name]);
        let is_as_expected = match expected.strip_suffix(" …") {
            Some(first) => found.starts_with(first),
            None => found == expected,
        };
        assert!(is_as_expected, "{setup}, {lane}: {found}");
    }
}

#[test]
fn every_clock_rate_and_fault_has_a_row_and_every_rate_a_colour() {
    let knobs = "0.1 control-hz 40\n0.2 control-hz 30\n0.3 control-hz 40\n0.35 sensor-hz 40\n\
                 0.4 crash sensor\n0.45 restart sensor";
    let (_folder, path) = recorded("", knobs);
    let rates = [MODES, "rate", "policy"];
    for (lane, changed) in [
        (&rates[..], "0 50 Hz, 100 40 Hz, 200 30 Hz, 300 40 Hz"),
        (&[MODES, "clock"], "0 virtual"),
        (&[MODES, "state", "sensor"], "400 crashed, 450 runs"),
        (&[MODES, "state", "policy"], ""),
    ] {
        assert_eq!(changes(&path, lane), changed);
    }
    let values = StateConfiguration::descriptor_values().component;
    let looks = chunks_of(&path)
        .into_iter()
        .filter(|chunk| *chunk.entity_path() == entity(&rates));
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

/// A tick of the real clock: its start, lateness and duration (ms), and the overruns by then.
fn tick(number: u64, [at, late, took]: [u64; 3], overruns: u64) -> TickRecord {
    TickRecord {
        number,
        at: ms(at),
        ends: None,
        lateness: Some(Duration::from_millis(late)),
        took: Some(Duration::from_millis(took)),
        overruns,
        push: None,
        causes: TickCauses::default(),
    }
}

/// The lane of the first of `nodes` in a run of the real clock, set up by `setup`.
fn lane_of(nodes: Vec<NodeTopology>, setup: &str, ticks: Vec<(usize, TickRecord)>) -> String {
    let (_folder, path) = file("given.rrd");
    let name = nodes[0].name.clone();
    let run = GivenRun {
        clock: ClockKind::Real,
        setup,
        nodes,
        ticks,
        events: Vec::new(),
        end: ms(100),
    };
    run.record(&path);
    changes(&path, &[TIMELINE, "node", &name])
}

#[test]
fn a_lane_has_the_late_part_of_each_tick_its_duration_and_whether_it_was_too_long() {
    let run = [
        tick(0, [3, 3, 4], 0),
        tick(1, [20, 0, 25], 1),
        tick(2, [60, 0, 20], 1),
        tick(3, [81, 1, 0], 1),
    ];
    let lane = "0 late, 3 tick, 7 -, 20 overrun, 45 -, 60 tick, 80 late, \
                81 tick without duration, 82 -";
    assert_eq!(
        lane_of(vec![node("own")], "", run.map(|tick| (0, tick)).to_vec()),
        lane
    );
}

#[test]
fn a_lane_of_an_executor_has_the_wait_and_what_was_set_aside() {
    let on_core = |name| NodeTopology {
        executor: Some("fixed-priority:1".to_owned()),
        executor_index: Some(0),
        ..node(name)
    };
    let nodes = ["own", "urgent"].map(on_core).to_vec();
    let ticks = vec![(0, tick(0, [3, 3, 9], 0)), (1, tick(0, [5, 0, 3], 0))];
    let lane = lane_of(nodes, "takes own 9, takes urgent 3", ticks);
    let expected = "0 waiting for the executor, 3 tick, 5 set aside, 8 tick, 12 -";
    assert_eq!(lane, expected);
}

#[test]
fn ticks_without_a_duration_stay_apart_at_any_rate() {
    let run = [0, 1].map(|number| TickRecord {
        at: Time::from_nanos(number * 500_000),
        ..tick(number, [0, 0, 0], 0)
    });
    let lane = lane_of(vec![node("own")], "", run.map(|tick| (0, tick)).to_vec());
    // The second begins within the width of the first.
    assert_eq!(lane, "0 tick without duration, 1.5 -");
}
