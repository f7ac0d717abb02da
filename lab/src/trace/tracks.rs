//! Tracks with their events, in order of time.

use ratelab::Time;

use super::perfetto::{
    CounterDescriptor, DebugAnnotation, Trace, TracePacket, TrackDescriptor, TrackEvent,
    event_type::{COUNTER, INSTANT, SLICE_BEGIN, SLICE_END},
};

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
