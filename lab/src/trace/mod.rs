//! A recording as a trace for Perfetto.

mod perfetto;

use prost::Message;
use ratelab::{Head, MessageId, Time};
use ratelab_metrics::{Lineage, TickWait, TracedTick, WaitsFor};
use ratelab_recording::{Recording, end_of};
use ratelab_system::{PlanBar, System, acting_node};

use perfetto::{
    CounterDescriptor, DebugAnnotation, Trace, TracePacket, TrackDescriptor, TrackEvent,
    event_type::{COUNTER, INSTANT, SLICE_BEGIN, SLICE_END},
};

/// Returns the bytes of a trace of `recording`, a run of `system`.
pub fn trace(recording: &Recording, system: &dyn System) -> Vec<u8> {
    let lineage = recording.lineage().along(system.about().latency_path());
    let topology = lineage.topology();
    let mut tracks = Tracks::default();
    let nodes = tracks.group("nodes");
    for (node, known) in topology.nodes.iter().enumerate() {
        let lane = tracks.lane(nodes, &known.name);
        let ticks = (0..).zip(lineage.ticks(node));
        let mut overruns = 0;
        for (index, worked) in ticks {
            tick(&mut tracks, lane, &lineage, node, index, worked);
            let more = worked.tick.overruns.saturating_sub(overruns);
            overruns = worked.tick.overruns;
            if more > 0 {
                let name = format!("{more} overrun");
                tracks.instant(lane, &*name, end_of(&worked.tick));
            }
        }
        waits(&mut tracks, nodes, &lineage, node);
    }
    let topics = tracks.group("topics");
    for (topic, known) in topology.topics.iter().enumerate() {
        let lane = tracks.lane(topics, &known.name);
        for sent in lineage.sent(topic) {
            message(&mut tracks, lane, topic, sent);
        }
    }
    if let Some(planning) = system.robot().planning() {
        let lanes = recording.plan_lanes(&planning);
        plans(&mut tracks, planning.plans, &lanes);
    }
    counters(&mut tracks, recording, &lineage, system);
    tracks.finish().encode_to_vec()
}

/// Returns whether `bytes` are a trace of this program, and nothing else.
pub fn is_trace(bytes: &[u8]) -> bool {
    Trace::decode(bytes).is_ok_and(|trace| trace.encoded_len() == bytes.len())
}

/// What the ticks of a node waited for, if anything: on a lane of its own, because a viewer draws
/// what overlaps as a part of what began before. The next tick may wait while one runs, and others
/// behind it: each wait is shown from the end of the one before.
fn waits(tracks: &mut Tracks, group: u64, lineage: &Lineage, node: usize) {
    let topology = lineage.topology();
    let ticks = 0..lineage.ticks(node).count();
    let (mut lane, mut before) = (None, Time::ZERO);
    for TickWait { from, to, what } in ticks.flat_map(|index| lineage.waits(node, index)) {
        if to <= before {
            continue;
        }
        let what = match what {
            WaitsFor::Match(topic) => {
                format!("waiting for {} to match", topology.topics[topic].name)
            }
            WaitsFor::Node(by) => format!("waiting for {}", topology.nodes[by].name),
            WaitsFor::Thread => "late".to_owned(),
        };
        let name = format!("{} waits", topology.nodes[node].name);
        let lane = *lane.get_or_insert_with(|| tracks.lane(group, &name));
        tracks.slice(lane, &*what, [from.max(before), to]);
        before = to;
    }
}

/// A tick, with what it was set aside for.
fn tick(
    tracks: &mut Tracks,
    lane: u64,
    lineage: &Lineage,
    node: usize,
    index: usize,
    worked: &TracedTick,
) {
    let tick = &worked.tick;
    let topology = lineage.topology();
    let text = EventText {
        name: "tick",
        flows: flows(lineage, node, index, worked),
        number: Some(("tick", tick.number)),
    };
    tracks.slice(lane, text, [tick.at, end_of(tick)]);
    for TickWait { from, to, what } in lineage.set_aside(node, index) {
        if let WaitsFor::Node(by) = what {
            let what = format!("set aside for {}", topology.nodes[by].name);
            tracks.slice(lane, &*what, [from, to.min(end_of(tick))]);
        }
    }
}

/// Returns the messages first read in a tick, and the messages published by it.
fn flows(lineage: &Lineage, node: usize, index: usize, worked: &TracedTick) -> Vec<u64> {
    let before = index
        .checked_sub(1)
        .and_then(|before| lineage.ticks(node).nth(before));
    let news = worked
        .reads()
        .filter(|read| before.is_none_or(|before| before.reads().all(|known| known != *read)));
    let mut flows: Vec<u64> = news.map(flow).collect();
    let made = lineage.made(node, index).into_iter();
    flows.extend(made.map(flow));
    flows
}

/// Returns the number of a message, unique over all topics.
fn flow(message: MessageId) -> u64 {
    let MessageId { topic, seq } = message;
    ((topic as u64 + 1) << 48) | seq
}

/// A message at its publication, and at its delivery if that is later.
fn message(tracks: &mut Tracks, lane: u64, topic: usize, sent: &Head) {
    let text = |name| EventText {
        name,
        flows: vec![flow(MessageId {
            topic,
            seq: sent.seq,
        })],
        number: Some(("seq", sent.seq)),
    };
    let name = match sent.arrives {
        None => "lost",
        Some(at) if at > sent.at => "sent",
        Some(_) => "message",
    };
    tracks.instant(lane, text(name), sent.at);
    if let Some(at) = sent.arrives.filter(|at| *at > sent.at) {
        tracks.instant(lane, text("arrived"), at);
    }
}

/// The plans on `topic`, and what was played of them.
fn plans(tracks: &mut Tracks, topic: &str, lanes: &[Vec<PlanBar>]) {
    if lanes.is_empty() {
        return;
    }
    let group = tracks.group("plans");
    for (number, bars) in (1..).zip(lanes) {
        let lane = tracks.lane(group, &format!("{topic} {number}"));
        for bar in bars {
            for part in &bar.parts {
                let text = EventText {
                    number: Some(("plan", bar.number)),
                    ..part.word().into()
                };
                tracks.slice(lane, text, [part.from, part.to]);
            }
        }
    }
}

fn counters(tracks: &mut Tracks, recording: &Recording, lineage: &Lineage, system: &dyn System) {
    let topology = lineage.topology();
    let group = tracks.group("counters");
    if let Some(node) = acting_node(system, topology) {
        let counter = tracks.counter(group, "age of the push", "ms");
        for (at, ms) in saw(lineage, node, recording.until) {
            tracks.count(counter, at, ms);
        }
    }
    for (topic, known) in topology.topics.iter().enumerate() {
        for &reader in &known.readers {
            let reading = &topology.nodes[reader].name;
            let name = format!("queue of {} before {reading}", known.name);
            let counter = tracks.counter(group, &name, "messages");
            for (at, waiting) in lineage.queue(topic, reader) {
                tracks.count(counter, at, waiting as f64);
            }
        }
        let name = format!("dropped on {}", known.name);
        let drops = tracks.counter(group, &name, "messages");
        let mut dropped = None;
        for head in recording.topics[topic].heads() {
            if dropped.replace(head.dropped) != Some(head.dropped) {
                tracks.count(drops, head.at, head.dropped as f64);
            }
        }
    }
}

/// Returns the run time and age (ms) at both ends of each tooth of the sawtooth.
fn saw(lineage: &Lineage, node: usize, until: Time) -> Vec<(Time, f64)> {
    let pushes = lineage.pushes(node);
    let ends = pushes.iter().skip(1).map(|push| push.since).chain([until]);
    let teeth = pushes.iter().zip(ends).flat_map(|(push, end)| {
        [push.since, end].map(|at| (at, push.parts(at).sum_ns() as f64 / 1e6))
    });
    teeth.collect()
}

/// The writer of all packets.
const WRITER: u32 = 1;

/// Shows tracks in the order in which they were added.
const EXPLICIT_ORDER: i32 = 3;

/// A trace under construction.
#[derive(Default)]
pub struct Tracks {
    tracks: Vec<TracePacket>,
    /// Run times, ranks within the same instant, and events.
    events: Vec<(Time, u8, TrackEvent)>,
}

/// What is told of an event: its name, the messages that pass through it, and its number with
/// the name of that.
pub struct EventText<'a> {
    /// Its name.
    pub name: &'a str,
    /// The messages that pass through it.
    pub flows: Vec<u64>,
    /// A number, with its name.
    pub number: Option<(&'static str, u64)>,
}

impl<'a> From<&'a str> for EventText<'a> {
    fn from(name: &'a str) -> Self {
        Self {
            name,
            flows: Vec::new(),
            number: None,
        }
    }
}

impl Tracks {
    /// Adds a parent for other tracks.
    pub fn group(&mut self, name: &str) -> u64 {
        self.track(None, name, None)
    }

    /// Adds a track for slices and instants.
    pub fn lane(&mut self, group: u64, name: &str) -> u64 {
        self.track(Some(group), name, None)
    }

    /// Adds a track for values.
    pub fn counter(&mut self, group: u64, name: &str, unit: &str) -> u64 {
        let unit_name = Some(unit.to_owned());
        self.track(Some(group), name, Some(CounterDescriptor { unit_name }))
    }

    fn track(
        &mut self,
        parent_uuid: Option<u64>,
        name: &str,
        counter: Option<CounterDescriptor>,
    ) -> u64 {
        let uuid = self.tracks.len() as u64 + 1;
        self.tracks.push(TracePacket {
            trusted_packet_sequence_id: Some(WRITER),
            track_descriptor: Some(TrackDescriptor {
                uuid: Some(uuid),
                name: Some(name.to_owned()),
                parent_uuid,
                counter,
                child_ordering: Some(EXPLICIT_ORDER),
                sibling_order_rank: i32::try_from(uuid).ok(),
            }),
            ..TracePacket::default()
        });
        uuid
    }

    /// Adds a slice from one run time to another.
    pub fn slice<'a>(&mut self, track: u64, text: impl Into<EventText<'a>>, [from, to]: [Time; 2]) {
        // At the same instant a slice ends before the next one begins, unless both are
        // the same slice.
        let rank = if to > from { 0 } else { 2 };
        let begin = told(track, SLICE_BEGIN, text.into());
        self.events.push((from, 1, begin));
        self.events.push((to, rank, event(track, SLICE_END)));
    }

    /// Adds an event without duration.
    pub fn instant<'a>(&mut self, track: u64, text: impl Into<EventText<'a>>, at: Time) {
        let instant = told(track, INSTANT, text.into());
        self.events.push((at, 3, instant));
    }

    /// Adds a new value of a counter.
    pub fn count(&mut self, track: u64, at: Time, value: f64) {
        let count = TrackEvent {
            double_counter_value: Some(value),
            ..event(track, COUNTER)
        };
        self.events.push((at, 3, count));
    }

    /// Finishes the trace.
    pub fn finish(mut self) -> Trace {
        self.events.sort_by_key(|(at, rank, _)| (*at, *rank));
        let events = self.events.into_iter().map(|(at, _, event)| TracePacket {
            timestamp: Some(at.as_nanos()),
            trusted_packet_sequence_id: Some(WRITER),
            track_event: Some(event),
            track_descriptor: None,
        });
        let mut packet = self.tracks;
        packet.extend(events);
        Trace { packet }
    }
}

fn told(track: u64, kind: i32, text: EventText<'_>) -> TrackEvent {
    let annotation = |(name, value): (&str, u64)| DebugAnnotation {
        name: Some(name.to_owned()),
        int_value: Some(i64::try_from(value).unwrap_or(i64::MAX)),
    };
    TrackEvent {
        name: Some(text.name.to_owned()),
        flow_ids: text.flows,
        debug_annotations: text.number.into_iter().map(annotation).collect(),
        ..event(track, kind)
    }
}

fn event(track: u64, kind: i32) -> TrackEvent {
    TrackEvent {
        r#type: Some(kind),
        track_uuid: Some(track),
        ..TrackEvent::default()
    }
}
