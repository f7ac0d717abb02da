//! The recorded data of topics and nodes for readers: every message and every tick, bit
//! for bit.

use std::time::Duration;

use ratelab::{Head, Time};
use ratelab_account::{RowTap, Rows, Tap, TickRecord};
use rerun::{EntityPath, RecordingStream, RecordingStreamResult, SeriesLines};

use super::{
    columns::{numbers, numbers_or_none, series},
    schema::{message, node_entity, tick, topic_entity},
    source::Tapped,
    timeline::Stamps,
};

/// Nanoseconds in a microsecond.
pub const NANOS_PER_MICRO: f64 = 1e3;

/// Items of a tap, waiting to be written.
pub trait Track {
    /// Takes the content of the tap; returns the number of items.
    fn drain(&mut self) -> usize;

    /// Number of items waiting to be written.
    fn waiting(&self) -> usize;

    /// Run time of the newest waiting item.
    fn newest(&self) -> Option<Time>;

    /// Number of items lost because the tap was full.
    fn lost(&self) -> u64;
}

/// The messages of a topic.
pub struct TopicTrack {
    /// Its name.
    pub name: String,
    /// Number of messages written.
    pub written: u64,
    fields: &'static [&'static str],
    entity: EntityPath,
    tap: RowTap,
    waiting: Rows,
}

impl TopicTrack {
    /// The messages of the topic called `name` from now on, with a tap of capacity
    /// `backlog`; `None` if the topic is not recorded.
    pub fn new(name: &str, taps: &dyn Tapped, backlog: usize) -> Option<Self> {
        let tap = taps.rows(name, backlog)?;
        Some(Self {
            name: name.to_owned(),
            written: 0,
            fields: taps.fields(name)?,
            entity: topic_entity(name),
            waiting: tap.rows(),
            tap,
        })
    }

    /// Writes the names of the numbers in its messages.
    pub fn begin(&self, rec: &RecordingStream) -> RecordingStreamResult<()> {
        let names = SeriesLines::new().with_names(self.fields.iter().copied());
        rec.log_static(self.entity.clone(), &names)
    }

    /// Removes and returns the waiting messages up to run time `until`.
    pub fn take(&mut self, until: Time) -> Rows {
        let rows = self.waiting.take_until(until);
        self.written += rows.len() as u64;
        rows
    }

    /// Writes `rows` at `stamps`.
    pub fn write(
        &self,
        rec: &RecordingStream,
        rows: &Rows,
        stamps: &Stamps,
    ) -> RecordingStreamResult<()> {
        if rows.is_empty() {
            return Ok(());
        }
        let heads = || rows.heads().iter();
        let origin = |head: &Head| head.origin.map(Time::as_nanos);
        let mut columns = vec![
            series(rows.values().to_vec(), rows.width(), rows.len())?,
            numbers(message::SEQ, heads().map(|head| head.seq))?,
            numbers_or_none(message::ORIGIN, heads().map(origin))?,
            numbers(message::DROPPED, heads().map(|head| head.dropped))?,
        ];
        // Most messages are stamped and delivered at their publication.
        for (name, number) in [
            (message::STAMP, stamp as fn(&Head) -> Option<u64>),
            (message::ARRIVES, arrival),
        ] {
            if heads().any(|head| number(head).is_some()) {
                columns.push(numbers_or_none(name, heads().map(number))?);
            }
        }
        rec.send_columns(self.entity.clone(), stamps.columns(), columns)
    }
}

/// The stamp of a message, if different from the run time of its publication.
fn stamp(head: &Head) -> Option<u64> {
    (head.stamp != head.at).then(|| head.stamp.as_nanos())
}

/// The delivery of a message, if different from its publication.
fn arrival(head: &Head) -> Option<u64> {
    let arrives = head.arrives.map_or(message::LOST, Time::as_nanos);
    (head.arrives != Some(head.at)).then_some(arrives)
}

impl Track for TopicTrack {
    fn drain(&mut self) -> usize {
        self.tap.take(&mut self.waiting)
    }

    fn waiting(&self) -> usize {
        self.waiting.len()
    }

    fn newest(&self) -> Option<Time> {
        self.waiting.heads().last().map(|head| head.at)
    }

    fn lost(&self) -> u64 {
        self.tap.lost()
    }
}

/// The ticks of a node.
pub struct NodeTrack {
    /// Number of ticks written.
    pub written: u64,
    entity: EntityPath,
    tap: Tap<TickRecord>,
    waiting: Vec<TickRecord>,
}

impl NodeTrack {
    /// The ticks from `tap` of the node called `name`.
    pub fn new(name: &str, tap: Tap<TickRecord>) -> Self {
        Self {
            written: 0,
            entity: node_entity(name),
            tap,
            waiting: Vec::new(),
        }
    }

    /// Removes and returns the waiting ticks up to run time `until`.
    pub fn take(&mut self, until: Time) -> Vec<TickRecord> {
        let count = self.waiting.partition_point(|tick| tick.at <= until);
        self.written += count as u64;
        let later = self.waiting.split_off(count);
        std::mem::replace(&mut self.waiting, later)
    }

    /// Writes `ticks` at `stamps`.
    pub fn write(
        &self,
        rec: &RecordingStream,
        ticks: &[TickRecord],
        stamps: &Stamps,
    ) -> RecordingStreamResult<()> {
        if ticks.is_empty() {
            return Ok(());
        }
        let nanos = |duration: Option<Duration>| duration.map(|d| d.as_nanos() as u64);
        let late = ticks.iter().map(|tick| nanos(tick.lateness));
        let late = late.map(|nanos| nanos.map_or(f64::NAN, |nanos| nanos as f64 / NANOS_PER_MICRO));
        let mut columns = vec![
            series(late.collect(), 1, ticks.len())?,
            numbers(tick::NUMBER, ticks.iter().map(|tick| tick.number))?,
            numbers_or_none(tick::TOOK, ticks.iter().map(|tick| nanos(tick.took)))?,
            numbers(tick::OVERRUNS, ticks.iter().map(|tick| tick.overruns))?,
        ];
        let pushes = || ticks.iter().map(|tick| tick.push);
        if pushes().any(|push| push.is_some()) {
            let pushed = pushes().map(|push| Some(push?.at.as_nanos()));
            let sensed = pushes().map(|push| Some(push?.sensed.as_nanos()));
            columns.push(numbers_or_none(tick::PUSHED, pushed)?);
            columns.push(numbers_or_none(tick::SENSED, sensed)?);
        }
        rec.send_columns(self.entity.clone(), stamps.columns(), columns)
    }
}

impl Track for NodeTrack {
    fn drain(&mut self) -> usize {
        // Only the items present now: a run without pacing fills it as fast as it is
        // emptied.
        let there = self.tap.items().len();
        self.waiting.extend(self.tap.items().try_iter().take(there));
        there
    }

    fn waiting(&self) -> usize {
        self.waiting.len()
    }

    fn newest(&self) -> Option<Time> {
        self.waiting.last().map(|tick| tick.at)
    }

    fn lost(&self) -> u64 {
        self.tap.lost()
    }
}
