//! Tracks and what is on them, in the order in which it happened.

use ratelab::runtime::Time;

use super::perfetto::{
    CounterDescriptor, DebugAnnotation, EventType, Trace, TracePacket, TrackDescriptor, TrackEvent,
};

/// The one who writes all packets.
const WRITER: u32 = 1;

/// Tracks are shown in the order in which they were added.
const EXPLICIT_ORDER: i32 = 3;

/// A trace that grows.
pub struct Tracks {
    tracks: Vec<TracePacket>,
    /// Run times, what comes first at the same one, and events.
    events: Vec<(Time, u8, TrackEvent)>,
}

/// Something that takes time.
pub struct Slice<'a> {
    /// What people call it.
    pub name: &'a str,
    /// When it begins.
    pub begins: Time,
    /// When it is over.
    pub ends: Time,
    /// The messages that pass there.
    pub flows: Vec<u64>,
    /// Facts about it.
    pub facts: Vec<DebugAnnotation>,
}

impl<'a> Slice<'a> {
    /// One that no message passes.
    pub fn new(name: &'a str, begins: Time, ends: Time) -> Self {
        Self {
            name,
            begins,
            ends,
            flows: Vec::new(),
            facts: Vec::new(),
        }
    }
}

impl Tracks {
    /// None yet.
    pub fn new() -> Self {
        Self {
            tracks: Vec::new(),
            events: Vec::new(),
        }
    }

    /// A track for others to be under.
    pub fn group(&mut self, name: &str) -> u64 {
        self.track(None, name, None)
    }

    /// A track for slices and instants.
    pub fn lane(&mut self, group: u64, name: &str) -> u64 {
        self.track(Some(group), name, None)
    }

    /// A track for values.
    pub fn counter(&mut self, group: u64, name: &str, unit: Option<&str>) -> u64 {
        let unit_name = unit.map(str::to_owned);
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

    /// Adds a slice.
    pub fn slice(&mut self, track: u64, slice: Slice<'_>) {
        let begin = TrackEvent {
            name: Some(slice.name.to_owned()),
            flow_ids: slice.flows,
            debug_annotations: slice.facts,
            ..event(track, EventType::SliceBegin)
        };
        // At one instant a slice ends before the next begins, unless it is the same.
        let rank = if slice.ends > slice.begins { 0 } else { 2 };
        self.events.push((slice.begins, 1, begin));
        self.events
            .push((slice.ends, rank, event(track, EventType::SliceEnd)));
    }

    /// Adds something that takes no time.
    pub fn instant(
        &mut self,
        track: u64,
        at: Time,
        name: &str,
        facts: Vec<DebugAnnotation>,
        flow_ids: Vec<u64>,
    ) {
        let instant = TrackEvent {
            name: Some(name.to_owned()),
            flow_ids,
            debug_annotations: facts,
            ..event(track, EventType::Instant)
        };
        self.events.push((at, 3, instant));
    }

    /// A counter has another value.
    pub fn count(&mut self, track: u64, at: Time, value: f64) {
        let count = TrackEvent {
            double_counter_value: Some(value),
            ..event(track, EventType::Counter)
        };
        self.events.push((at, 3, count));
    }

    /// The trace.
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

fn event(track: u64, kind: EventType) -> TrackEvent {
    TrackEvent {
        r#type: Some(kind.into()),
        track_uuid: Some(track),
        ..TrackEvent::default()
    }
}
