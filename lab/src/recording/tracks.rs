//! What is recorded of topics and nodes for readers: every message and every
//! tick, to the bit.

use std::time::Duration;

use ratelab::runtime::{Fields, Payload, Tap, TapMessage, TickRecord, Time};
use rerun::{RecordingStream, RecordingStreamResult, SeriesLines};

use super::{
    columns::{numbers, numbers_or_none, series},
    schema::{message, tick},
    timeline::Stamps,
};

/// Nanoseconds in a microsecond.
pub const NANOS_PER_MICRO: f64 = 1e3;

/// What comes out of a tap, waiting to be written.
pub struct TapQueue<T> {
    tap: Tap<T>,
    waiting: Vec<T>,
    /// How many were written.
    pub written: u64,
}

/// Something with a place in run time.
pub trait Stamped {
    /// Its run time.
    fn stamp(&self) -> Time;
}

impl<T> Stamped for TapMessage<T> {
    fn stamp(&self) -> Time {
        self.message.stamp
    }
}

impl Stamped for TickRecord {
    fn stamp(&self) -> Time {
        self.at
    }
}

impl<T: Stamped> TapQueue<T> {
    /// Nothing yet.
    pub fn new(tap: Tap<T>) -> Self {
        Self {
            tap,
            waiting: Vec::new(),
            written: 0,
        }
    }

    /// Takes what is in the tap; says how much that was.
    pub fn drain(&mut self) -> usize {
        // No more than there is now: a run flat out fills it as fast.
        let there = self.tap.items().len();
        self.waiting.extend(self.tap.items().try_iter().take(there));
        there
    }

    /// How much waits to be written.
    pub fn waiting(&self) -> usize {
        self.waiting.len()
    }

    /// Run time of the newest that waits.
    pub fn newest(&self) -> Option<Time> {
        self.waiting.last().map(Stamped::stamp)
    }

    /// Hands out what waits and is not later than `until`, to be written.
    pub fn take(&mut self, until: Time) -> Vec<T> {
        let count = self.waiting.partition_point(|item| item.stamp() <= until);
        self.written += count as u64;
        let later = self.waiting.split_off(count);
        std::mem::replace(&mut self.waiting, later)
    }

    /// How much came while the tap was full.
    pub fn lost(&self) -> u64 {
        self.tap.lost()
    }
}

/// Says what the numbers of a topic's messages are.
pub fn name_fields<T: Fields>(rec: &RecordingStream, entity: &str) -> RecordingStreamResult<()> {
    rec.log_static(
        entity,
        &SeriesLines::new().with_names(T::FIELDS.iter().copied()),
    )
}

/// Writes messages.
pub fn write_messages<T: Fields + Payload>(
    rec: &RecordingStream,
    entity: &str,
    messages: &[TapMessage<T>],
    stamps: &Stamps,
) -> RecordingStreamResult<()> {
    if messages.is_empty() {
        return Ok(());
    }
    let mut values = Vec::with_capacity(messages.len() * T::FIELDS.len());
    for tapped in messages {
        tapped.message.data.append_to(&mut values);
    }
    let origins = messages.iter().map(|tapped| tapped.message.origin);
    let columns = [
        series(values, T::FIELDS.len())?,
        numbers(message::SEQ, messages.iter().map(|m| m.message.seq))?,
        numbers_or_none(message::ORIGIN, origins.map(|o| o.map(Time::as_nanos)))?,
        numbers(message::DROPPED, messages.iter().map(|m| m.dropped))?,
    ];
    rec.send_columns(entity, stamps.columns(), columns)
}

/// Writes ticks.
pub fn write_ticks(
    rec: &RecordingStream,
    entity: &str,
    ticks: &[TickRecord],
    stamps: &Stamps,
) -> RecordingStreamResult<()> {
    if ticks.is_empty() {
        return Ok(());
    }
    let nanos = |duration: Option<Duration>| duration.map(|d| d.as_nanos() as u64);
    let late = ticks.iter().map(|t| nanos(t.lateness));
    let late = late.map(|nanos| nanos.map_or(f64::NAN, |nanos| nanos as f64 / NANOS_PER_MICRO));
    let columns = [
        series(late.collect(), 1)?,
        numbers(tick::NUMBER, ticks.iter().map(|t| t.number))?,
        numbers_or_none(tick::TOOK, ticks.iter().map(|t| nanos(t.took)))?,
        numbers(tick::OVERRUNS, ticks.iter().map(|t| t.overruns))?,
    ];
    rec.send_columns(entity, stamps.columns(), columns)
}

#[cfg(test)]
mod tests {
    use ratelab::runtime::{Backpressure, Depth, Time, Topic};

    use super::TapQueue;

    #[test]
    fn what_comes_too_fast_is_counted() {
        let topic = Topic::new("/test", Depth::ONE);
        let mut track = TapQueue::new(topic.tap(3, Backpressure::default()));
        let publisher = topic.publisher();
        (0..10).for_each(|at| publisher.publish((), Time::from_nanos(at), None));
        assert_eq!((track.drain(), track.lost()), (3, 7));
        assert_eq!(track.take(Time::from_nanos(1)).len(), 2);
        assert_eq!((track.waiting(), track.written), (1, 2));
    }
}
