//! A trace for Perfetto, decoded by a reader that shares nothing with its writer.

mod support;

use std::{collections::BTreeMap, fs};

use support::{complaint, folder, path, ratelab, text};

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
        text(self.bytes())
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
        let knobs = ["takes policy 30", "link /action delay:12", "wakes sensor 2"];
        let mut args = vec!["--world", "own"];
        knobs.iter().for_each(|knob| args.extend(["--knob", knob]));
        Self::of(&args)
    }

    /// Two seconds of virtual time with these arguments.
    fn of(args: &[&str]) -> Self {
        let folder = folder();
        let (file, trace) = (path(&folder, "run.rrd"), path(&folder, "run.pftrace"));
        let (before, after) = (["run"], ["--clock", "virtual", "--duration-s", "2"]);
        let record = ["--record", &file, "--json"];
        let ran = ratelab(&[&before, args, &after, &record].concat());
        let metrics: serde_json::Value = serde_json::from_slice(&ran.stdout).expect("metrics");
        let said = text(&ratelab(&["trace", &file]).stdout);
        assert!(
            said.contains("run.pftrace") && said.contains("perfetto"),
            "{said}"
        );
        let (tracks, events) = decoded(&fs::read(trace).expect("a trace"));
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
}

#[test]
fn a_trace_holds_what_the_recording_does() {
    let trace = Traced::new();
    assert!(trace.events.is_sorted_by_key(|(at, ..)| *at));
    for node in ["sensor", "policy", "actuator"] {
        let named = |name: &str| {
            let slices = trace.on(node, 1);
            slices
                .filter(|(.., event)| event[&23][0].text() == name)
                .count() as u64
        };
        assert_eq!(
            Some(named("tick")),
            trace.metrics["nodes"][node]["ticks"].as_u64(),
            "{node}"
        );
        assert_eq!(
            trace.on(node, 1).count(),
            trace.on(node, 2).count(),
            "{node}"
        );
        let waits = format!("{node} waits");
        assert_eq!(
            trace.tracks.contains_key(&waits),
            node == "sensor",
            "{node}"
        );
    }
    assert!(trace.on("sensor waits", 1).count() > 0);
    let published = trace.metrics["topics"]["/action"]["published"].as_u64();
    let sent = trace
        .on("/action", 3)
        .filter(|(.., event)| event[&23][0].text() == "sent");
    assert_eq!(Some(sent.count() as u64), published);
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

#[test]
fn a_message_that_waits_for_a_match_is_a_slice_before_the_tick() {
    let folder = folder();
    let graph = path(&folder, "pair.toml");
    let node = |name: &str, more: &str| format!("[node.{name}]\n{more}\n");
    let camera = |side: &str, ms: u64| {
        let more = format!("trigger = [\"/tick\"]\ntakes = {ms}\npublishes = [\"/{side}\"]");
        node(side, &more)
    };
    let file = [
        "name = \"pair\"\n".to_owned(),
        node("clock", "rate = 10\npublishes = [\"/tick\"]"),
        camera("left", 5),
        camera("right", 30),
        node("stereo", "trigger = [\"/left\", \"/right\"]\ntakes = 8"),
    ];
    fs::write(&graph, file.concat()).expect("written");
    let trace = Traced::of(&[&graph]);
    let first = |track: &str| {
        let (at, .., event) = trace.on(track, 1).next().expect("a slice");
        (at / 1_000_000, event[&23][0].text())
    };
    let waits = "waiting for /right to match".to_owned();
    assert_eq!(first("stereo waits"), (5, waits));
    assert_eq!(first("stereo"), (30, "tick".to_owned()));
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
    let folder = folder();
    let graph = path(&folder, "busy.toml");
    let nodes = [("a", 50, 9), ("b", 40, 17), ("c", 10, 30)];
    for (executor, more) in [
        ("single", ""),
        ("multi:2", "group = \"g\"\n"),
        ("events", ""),
        ("fixed-priority:1", ""),
        ("edf:2", ""),
    ] {
        let nodes = nodes.map(|(name, rate, takes)| {
            format!(
                "[node.{name}]\nrate = {rate}\ntakes = {takes}\npublishes = [\"/{name}\"]\n{more}"
            )
        });
        let file = format!(
            "name = \"busy\"\n[executor.e]\nkind = \"{executor}\"\n{}",
            nodes.concat()
        );
        fs::write(&graph, file).expect("written");
        let trace = Traced::of(&[&graph]);
        let within_ticks = executor == "fixed-priority:1";
        let overlaps = overlaps(&trace).into_iter();
        let overlaps = overlaps.filter(|(track, _)| !within_ticks || track.contains("waits"));
        assert_eq!(overlaps.collect::<Vec<_>>(), [], "{executor}");
    }
}

#[test]
fn who_is_in_the_same_group_is_waited_for_while_a_thread_is_free() {
    let folder = folder();
    let graph = path(&folder, "group.toml");
    let node = |name: &str, takes: u64, more: &str| {
        format!("[node.{name}]\nrate = 10\ntakes = {takes}\npublishes = [\"/{name}\"]\n{more}")
    };
    let grouped = "group = \"g\"\n";
    let nodes = [
        node("long", 40, ""),
        node("x", 20, grouped),
        node("y", 5, grouped),
    ];
    let file = format!(
        "name = \"group\"\n[executor.e]\nkind = \"multi:4\"\n{}",
        nodes.concat()
    );
    fs::write(&graph, file).expect("written");
    let trace = Traced::of(&[&graph]);
    let mut waits = trace
        .on("y waits", 1)
        .map(|(.., event)| event[&23][0].text());
    assert!(waits.all(|wait| wait == "waiting for x"));
}

#[test]
fn what_cannot_be_traced_is_refused_in_a_line() {
    let folder = folder();
    let recording = support::reference("fall-5hz.rrd");
    let said = complaint(&ratelab(&["trace", &recording, "-o", &recording]), 2);
    assert!(said.contains("this is the file that is read"), "{said}");
    let nowhere = path(&folder, "none/run.pftrace");
    let said = complaint(&ratelab(&["trace", &recording, "-o", &nowhere]), 2);
    assert!(said.contains("there is no such folder"), "{said}");
    let said = complaint(&ratelab(&["trace", &path(&folder, "no.rrd")]), 2);
    assert!(said.contains("no.rrd"), "{said}");
}
