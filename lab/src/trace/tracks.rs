//! Tracks with their events, in order of time.

use ratelab::Time;

use super::perfetto::{
    CounterDescriptor, DebugAnnotation, EventType, Trace, TracePacket, TrackDescriptor, TrackEvent,
};

/// The writer of all packets.
const WRITER: u32 = 1;

/// Shows tracks in the order in which they were added.
const EXPLICIT_ORDER: i32 = 3;

/// A trace under construction.
pub struct Tracks {
    tracks: Vec<TracePacket>,
    /// Run times, ranks within the same instant, and events.
    events: Vec<(Time, u8, TrackEvent)>,
}

/// An event with a duration.
pub struct Slice<'a> {
    /// Its name.
    pub name: &'a str,
    /// Begin (run time).
    pub begins: Time,
    /// End (run time).
    pub ends: Time,
    /// The messages that pass through it.
    pub flows: Vec<u64>,
    /// Annotations.
    pub facts: Vec<DebugAnnotation>,
}

impl<'a> Slice<'a> {
    /// Creates a slice without messages.
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
    /// Creates an empty trace.
    pub fn new() -> Self {
        Self {
            tracks: Vec::new(),
            events: Vec::new(),
        }
    }

    /// Adds a parent for other tracks.
    pub fn group(&mut self, name: &str) -> u64 {
        self.track(None, name, None)
    }

    /// Adds a track for slices and instants.
    pub fn lane(&mut self, group: u64, name: &str) -> u64 {
        self.track(Some(group), name, None)
    }

    /// Adds a track for values.
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
        // At the same instant a slice ends before the next one begins, unless both are
        // the same slice.
        let rank = if slice.ends > slice.begins { 0 } else { 2 };
        self.events.push((slice.begins, 1, begin));
        self.events
            .push((slice.ends, rank, event(track, EventType::SliceEnd)));
    }

    /// Adds an event without duration.
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

    /// Adds a new value of a counter.
    pub fn count(&mut self, track: u64, at: Time, value: f64) {
        let count = TrackEvent {
            double_counter_value: Some(value),
            ..event(track, EventType::Counter)
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

fn event(track: u64, kind: EventType) -> TrackEvent {
    TrackEvent {
        r#type: Some(kind.into()),
        track_uuid: Some(track),
        ..TrackEvent::default()
    }
}
