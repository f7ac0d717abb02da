//! A trace for Perfetto, decoded by a reader that shares nothing with its writer.

use std::collections::BTreeMap;

use crate::support::{Folder, Said};

/// A field of a protocol buffer.
#[derive(Clone, Debug)]
enum Field {
    Number(u64),
    Bytes(Vec<u8>),
}

impl Field {
    fn number(&self) -> u64 {
        match self {
            Self::Number(number) => *number,
            Self::Bytes(bytes) => panic!("{bytes:?} are no number"),
        }
    }

    fn bytes(&self) -> &[u8] {
        match self {
            Self::Bytes(bytes) => bytes,
            Self::Number(number) => panic!("{number} is no text"),
        }
    }

    fn text(&self) -> String {
        Said::of(self.bytes()).0
    }
}

/// The fields of a message, by number.
type Fields = BTreeMap<u64, Vec<Field>>;

fn varint(bytes: &mut &[u8]) -> u64 {
    let (mut value, mut shift) = (0, 0);
    loop {
        let (first, rest) = bytes.split_first().expect("a number to its end");
        *bytes = rest;
        value |= u64::from(first & 0x7f) << shift;
        shift += 7;
        if first & 0x80 == 0 {
            return value;
        }
    }
}

fn take<'b>(bytes: &mut &'b [u8], count: usize) -> &'b [u8] {
    let (taken, rest) = bytes.split_at(count);
    *bytes = rest;
    taken
}

fn fields(mut bytes: &[u8]) -> Fields {
    let mut fields = Fields::new();
    while !bytes.is_empty() {
        let key = varint(&mut bytes);
        let field = match key & 7 {
            0 => Field::Number(varint(&mut bytes)),
            1 => {
                let fixed = take(&mut bytes, 8).try_into().expect("eight bytes");
                Field::Number(u64::from_le_bytes(fixed))
            }
            2 => {
                let count = varint(&mut bytes) as usize;
                Field::Bytes(take(&mut bytes, count).to_vec())
            }
            other => panic!("wire type {other}"),
        };
        fields.entry(key >> 3).or_default().push(field);
    }
    fields
}

/// Run time, type, track, and all fields of an event.
type Event = (u64, u64, u64, Fields);

/// The tracks of a trace by their names, and its events.
fn decoded(trace: &[u8]) -> (BTreeMap<String, u64>, Vec<Event>) {
    let (mut tracks, mut events) = (BTreeMap::new(), Vec::new());
    for packet in fields(trace).remove(&1).unwrap_or_default() {
        let packet = fields(packet.bytes());
        assert_eq!(packet[&10][0].number(), 1, "a sequence");
        if let Some(track) = packet.get(&60) {
            let track = fields(track[0].bytes());
            tracks.insert(track[&2][0].text(), track[&1][0].number());
        }
        if let Some(event) = packet.get(&11) {
            let event = fields(event[0].bytes());
            let (kind, track) = (event[&9][0].number(), event[&11][0].number());
            events.push((packet[&8][0].number(), kind, track, event));
        }
    }
    (tracks, events)
}

/// A run: its metrics, and its trace.
struct Traced {
    metrics: serde_json::Value,
    tracks: BTreeMap<String, u64>,
    events: Vec<Event>,
}

impl Traced {
    /// A run with costs, a link and lateness.
    fn new() -> Self {
        let knobs = "--knob 'link /action delay:12' --knob 'wakes sensor 2'";
        let options = format!("--world own --knob 'takes policy 30' {knobs}");
        Self::of(&Folder::new(), &options)
    }

    /// A run of the graph file `text`.
    fn of_graph(text: &str) -> Self {
        let folder = Folder::new();
        folder.write("graph.toml", format!("name = \"graph\"\n{text}"));
        Self::of(&folder, "graph.toml")
    }

    /// Two seconds of virtual time with these options.
    fn of(folder: &Folder, options: &str) -> Self {
        let record = "--clock virtual --duration-s 2 --record run.rrd --json";
        // Some graphs miss their goal.
        let ran = folder.does(&format!("run {options} {record}"));
        let metrics = serde_json::from_slice(&ran.stdout).expect("metrics");
        let said = folder.says("trace run.rrd");
        said.has("run.pftrace").has("perfetto");
        let (tracks, events) = decoded(&folder.bytes("run.pftrace"));
        Self {
            metrics,
            tracks,
            events,
        }
    }

    /// The events of this kind on a track.
    fn on(&self, track: &str, kind: u64) -> impl Iterator<Item = &Event> {
        let track = self.tracks[track];
        let events = self.events.iter();
        events.filter(move |(_, known, on, _)| (*known, *on) == (kind, track))
    }

    /// The names of those events.
    fn names(&self, track: &str, kind: u64) -> Vec<String> {
        let events = self.on(track, kind);
        events.map(|(.., event)| event[&23][0].text()).collect()
    }
}

#[test]
fn a_trace_holds_what_the_recording_does() {
    let trace = Traced::new();
    assert!(trace.events.is_sorted_by_key(|(at, ..)| *at));
    let count = |track, kind, name: &str| {
        let names = trace.names(track, kind);
        names.iter().filter(|known| *known == name).count()
    };
    for node in ["sensor", "policy", "actuator"] {
        let ticks = &trace.metrics["nodes"][node]["ticks"];
        assert_eq!(*ticks, count(node, 1, "tick"), "{node}");
        let [begun, ended] = [1, 2].map(|kind| trace.on(node, kind).count());
        assert_eq!(begun, ended, "{node}");
        let waits = trace.tracks.contains_key(&format!("{node} waits"));
        assert_eq!(waits, node == "sensor", "{node}");
    }
    assert!(trace.on("sensor waits", 1).count() > 0);
    let published = &trace.metrics["topics"]["/action"]["published"];
    assert_eq!(*published, count("/action", 3, "sent"));
}

#[test]
fn messages_flow_from_tick_to_tick_and_the_age_is_that_of_the_run() {
    let trace = Traced::new();
    // A message goes from the tick that published it to the one that read it.
    let flow = trace.on("/action", 3).next().expect("a message").3[&47][0].number();
    let passes = |(.., event): &&Event| {
        let flows = event.get(&47).into_iter().flatten();
        flows.clone().any(|known| known.number() == flow)
    };
    let stops: Vec<u64> = trace
        .events
        .iter()
        .filter(passes)
        .map(|(_, _, track, _)| *track)
        .collect();
    for stop in ["policy", "/action", "actuator"] {
        assert!(stops.contains(&trace.tracks[stop]), "{stop} in {stops:?}");
    }

    // The age is that of the metrics: 30 ms of thought, 12 on the link, and more.
    let ages = trace
        .on("age of the push", 4)
        .map(|(.., event)| f64::from_bits(event[&44][0].number()));
    let ages: Vec<f64> = ages.collect();
    assert!(ages.iter().all(|age| *age >= 42.0), "{ages:?}");
}

/// A node of a graph file.
fn node(name: &str, more: &str) -> String {
    format!("[node.{name}]\n{more}\n")
}

/// The same, which works for `takes` ms and publishes what is called like it.
fn working(name: &str, rate: u64, takes: u64, more: &str) -> String {
    let times = format!("rate = {rate}\ntakes = {takes}");
    node(name, &format!("{times}\npublishes = [\"/{name}\"]\n{more}"))
}

#[test]
fn a_message_that_waits_for_a_match_is_a_slice_before_the_tick() {
    let camera = |side: &str, ms: u64| {
        let more = format!("trigger = [\"/tick\"]\ntakes = {ms}\npublishes = [\"/{side}\"]");
        node(side, &more)
    };
    let graph = [
        node("clock", "rate = 10\npublishes = [\"/tick\"]"),
        camera("left", 5),
        camera("right", 30),
        node("stereo", "trigger = [\"/left\", \"/right\"]\ntakes = 8"),
    ];
    let trace = Traced::of_graph(&graph.concat());
    for (track, at, name) in [
        ("stereo waits", 5, "waiting for /right to match"),
        ("stereo", 30, "tick"),
    ] {
        let first = trace.on(track, 1).next().expect("a slice").0;
        assert_eq!((first / 1_000_000, &*trace.names(track, 1)[0]), (at, name));
    }
}

/// The slices of each track that begin within another one and end after it.
fn overlaps(trace: &Traced) -> Vec<(String, u64)> {
    let mut overlaps = Vec::new();
    for (name, track) in &trace.tracks {
        let mut depth = 0;
        for (at, kind, ..) in trace.events.iter().filter(|(_, _, on, _)| on == track) {
            depth += match kind {
                1 => 1,
                2 => -1,
                _ => 0,
            };
            if depth > 1 {
                overlaps.push((name.clone(), at / 1_000_000));
            }
        }
    }
    overlaps
}

#[test]
fn no_slices_of_a_track_overlap_but_those_within_a_tick_set_aside() {
    for (executor, more) in [
        ("single", ""),
        ("multi:2", "group = \"g\""),
        ("events", ""),
        ("fixed-priority:1", ""),
        ("edf:2", ""),
    ] {
        let nodes = [("a", 50, 9), ("b", 40, 17), ("c", 10, 30)];
        let nodes = nodes.map(|(name, rate, takes)| working(name, rate, takes, more));
        let executed = format!("[executor.e]\nkind = \"{executor}\"\n");
        let trace = Traced::of_graph(&(executed + &nodes.concat()));
        let within_ticks = executor == "fixed-priority:1";
        let overlaps = overlaps(&trace).into_iter();
        let overlaps = overlaps.filter(|(track, _)| !within_ticks || track.contains("waits"));
        assert_eq!(overlaps.collect::<Vec<_>>(), [], "{executor}");
    }
}

#[test]
fn who_is_in_the_same_group_is_waited_for_while_a_thread_is_free() {
    let nodes = [
        "[executor.e]\nkind = \"multi:4\"\n".to_owned(),
        working("long", 10, 40, ""),
        working("x", 10, 20, "group = \"g\""),
        working("y", 10, 5, "group = \"g\""),
    ];
    let trace = Traced::of_graph(&nodes.concat());
    let waits = trace.names("y waits", 1);
    assert!(!waits.is_empty());
    assert!(
        waits.iter().all(|wait| wait == "waiting for x"),
        "{waits:?}"
    );
}
