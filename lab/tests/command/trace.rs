//! A trace for Perfetto, decoded by the numbers that its fields have there.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
};

use prost::Message;

use crate::support::{Folder, table::rows};

#[derive(Message)]
struct Trace {
    #[prost(message, repeated, tag = "1")]
    packets: Vec<Packet>,
}

#[derive(Message)]
struct Packet {
    #[prost(uint64, tag = "8")]
    at: u64,
    #[prost(uint32, tag = "10")]
    sequence: u32,
    #[prost(message, optional, tag = "11")]
    event: Option<TrackEvent>,
    #[prost(message, optional, tag = "60")]
    track: Option<Track>,
}

#[derive(Message)]
struct Track {
    #[prost(uint64, tag = "1")]
    id: u64,
    #[prost(string, tag = "2")]
    name: String,
}

#[derive(Message)]
struct TrackEvent {
    #[prost(int32, tag = "9")]
    kind: i32,
    #[prost(uint64, tag = "11")]
    track: u64,
    #[prost(string, tag = "23")]
    name: String,
    #[prost(double, tag = "44")]
    value: f64,
    #[prost(fixed64, repeated, tag = "47")]
    flows: Vec<u64>,
}

// Kinds of events.
const BEGIN: i32 = 1;
const END: i32 = 2;
const INSTANT: i32 = 3;
const COUNTER: i32 = 4;

/// A run: its metrics, and its trace: tracks by their names, and events with their run times.
struct Traced {
    metrics: serde_json::Value,
    tracks: BTreeMap<String, u64>,
    events: Vec<(u64, TrackEvent)>,
}

impl Traced {
    /// A run with costs, a link and lateness.
    fn new() -> Self {
        let knobs = "--knob 'link /action delay:12' --knob 'wakes sensor 2'";
        let options = format!("--world own --knob 'takes policy 30' {knobs}");
        Self::run(&Folder::new(), &options)
    }

    /// A run of the graph file `text`.
    fn run_graph(text: &str) -> Self {
        let folder = Folder::new();
        folder.write("graph.toml", format!("name = \"graph\"\n{text}"));
        Self::run(&folder, "graph.toml")
    }

    /// Two seconds of virtual time with these options.
    fn run(folder: &Folder, options: &str) -> Self {
        let record = "--clock virtual --duration-s 2 --record run.rrd --json";
        // Some graphs miss their goal.
        let ran = folder.does(&format!("run {options} {record}"));
        let metrics = serde_json::from_slice(&ran.stdout).expect("metrics");
        folder.plays("ratelab trace run.rrd => run.pftrace => perfetto");
        let trace = fs::read(folder.path("run.pftrace")).expect("a trace");
        let trace = Trace::decode(&*trace).expect("a protocol buffer");
        let (mut tracks, mut events) = (BTreeMap::new(), Vec::new());
        for packet in trace.packets {
            assert_eq!(packet.sequence, 1);
            tracks.extend(packet.track.map(|track| (track.name, track.id)));
            events.extend(packet.event.map(|event| (packet.at, event)));
        }
        Self {
            metrics,
            tracks,
            events,
        }
    }

    /// The events of this kind on a track.
    fn on(&self, track: &str, kind: i32) -> impl Iterator<Item = &(u64, TrackEvent)> {
        let on = (kind, self.tracks[track]);
        let events = self.events.iter();
        events.filter(move |(_, event)| (event.kind, event.track) == on)
    }

    /// The names of those events.
    fn names(&self, track: &str, kind: i32) -> Vec<&str> {
        let events = self.on(track, kind);
        events.map(|(_, event)| &*event.name).collect()
    }
}

#[test]
fn a_trace_holds_what_the_recording_does() {
    let trace = Traced::new();
    assert!(trace.events.is_sorted_by_key(|(at, _)| *at));
    let count = |track, kind, name: &str| {
        let names = trace.names(track, kind);
        names.iter().filter(|known| **known == name).count()
    };
    for node in ["sensor", "policy", "actuator"] {
        let ticks = &trace.metrics["nodes"][node]["ticks"];
        assert_eq!(*ticks, count(node, BEGIN, "tick"), "{node}");
        let [begun, ended] = [BEGIN, END].map(|kind| trace.on(node, kind).count());
        assert_eq!(begun, ended, "{node}");
        let waits = trace.tracks.contains_key(&format!("{node} waits"));
        assert_eq!(waits, node == "sensor", "{node}");
    }
    assert!(trace.on("sensor waits", BEGIN).count() > 0);
    let published = &trace.metrics["topics"]["/action"]["published"];
    assert_eq!(*published, count("/action", INSTANT, "sent"));
}

#[test]
fn messages_flow_from_tick_to_tick_and_the_age_is_that_of_the_run() {
    let trace = Traced::new();
    // A message goes from the tick that published it to the one that read it.
    let (_, message) = trace.on("/action", INSTANT).next().expect("a message");
    let events = trace.events.iter().map(|(_, event)| event);
    let passed = events.filter(|event| event.flows.contains(&message.flows[0]));
    let stops: Vec<u64> = passed.map(|event| event.track).collect();
    for stop in ["policy", "/action", "actuator"] {
        assert!(stops.contains(&trace.tracks[stop]), "{stop} in {stops:?}");
    }
    // The age is that of the metrics: 30 ms of thought, 12 on the link, and more.
    let ages = trace.on("age of the push", COUNTER);
    let ages: Vec<f64> = ages.map(|(_, event)| event.value).collect();
    assert!(ages.iter().all(|age| *age >= 42.0), "{ages:?}");
}

#[test]
fn a_message_that_waits_for_a_match_is_a_slice_before_the_tick() {
    let trace = Traced::run_graph(
        r#"
        [node]
        clock = { rate = 10, publishes = ["/tick"] }
        left = { trigger = ["/tick"], takes = 5, publishes = ["/left"] }
        right = { trigger = ["/tick"], takes = 30, publishes = ["/right"] }
        stereo = { trigger = ["/left", "/right"], takes = 8 }
        "#,
    );
    for (track, at, name) in [
        ("stereo waits", 5, "waiting for /right to match"),
        ("stereo", 30, "tick"),
    ] {
        let (first, slice) = trace.on(track, BEGIN).next().expect("a slice");
        assert_eq!((first / 1_000_000, &*slice.name), (at, name));
    }
}

/// The slices of each track that begin within another one and end after it.
fn overlaps(trace: &Traced) -> Vec<(&str, u64)> {
    let mut overlaps = Vec::new();
    for (name, track) in &trace.tracks {
        let mut depth = 0;
        for (at, event) in trace.events.iter().filter(|(_, on)| on.track == *track) {
            depth += match event.kind {
                BEGIN => 1,
                END => -1,
                _ => 0,
            };
            if depth > 1 {
                overlaps.push((&**name, at / 1_000_000));
            }
        }
    }
    overlaps
}

#[test]
fn no_slices_of_a_track_overlap_but_those_within_a_tick_set_aside() {
    let graph = r#"
        executor.e.kind = "KIND"
        [node]
        a = { rate = 50, takes = 9 }
        b = { rate = 40, takes = 17 }
        c = { rate = 10, takes = 30 }
    "#;
    for kind in ["single", "multi:2", "events", "fixed-priority:1", "edf:2"] {
        let group = if kind == "multi:2" {
            r#", group = "g" }"#
        } else {
            " }"
        };
        let trace = Traced::run_graph(&graph.replace("KIND", kind).replace(" }", group));
        let within_ticks = kind == "fixed-priority:1";
        let overlaps = overlaps(&trace).into_iter();
        let overlaps = overlaps.filter(|(track, _)| !within_ticks || track.contains("waits"));
        assert_eq!(overlaps.collect::<Vec<_>>(), [], "{kind}");
    }
}

#[test]
fn who_is_in_the_same_group_is_waited_for_while_a_thread_is_free() {
    let trace = Traced::run_graph(
        r#"
        executor.e.kind = "multi:4"
        [node]
        long = { rate = 10, takes = 40 }
        x = { rate = 10, takes = 20, group = "g" }
        y = { rate = 10, takes = 5, group = "g" }
        "#,
    );
    let mut waits = trace.names("y waits", BEGIN);
    waits.dedup();
    assert_eq!(waits, ["waiting for x"]);
}

#[test]
fn plans_are_bars_that_do_not_overlap_with_the_part_that_was_played() {
    for [lanes, options] in rows(
        "6 | --chunk 50 --think-ms 200 --control-hz 5 --plan committed
         2 | --chunk 10 --think-ms 100 --control-hz 5 --plan committed
         11 | --chunk 10 --merge ensemble:0.01 --control-hz 50
         2 | --chunk 20 --think-ms 60 --play arrival --refill 0
         0 |",
    ) {
        let trace = Traced::run(&Folder::new(), &format!("--world own {options}"));
        let plans = |name: &&String| name.starts_with("/chunk ");
        let names: Vec<&String> = trace.tracks.keys().filter(plans).collect();
        assert_eq!(names.len().to_string(), lanes, "{options}: {names:?}");
        assert_eq!(overlaps(&trace), [], "{options}");
        let words = names.iter().flat_map(|name| trace.names(name, BEGIN));
        let words: BTreeSet<&str> = words.collect();
        let usual = BTreeSet::from(["planned", "played"]);
        assert!(names.is_empty() || words == usual, "{options}: {words:?}");
    }
}
