//! What is recorded of a message and of a tick: the one description by which both are written,
//! read, digested and compared.

use std::time::Duration;

use ratelab::{Head, Push, Time};
use ratelab_account::{RowTap, Rows, Tap, TickRecord};

use super::{
    columns::{
        ColumnForm::{Count, Delivery, Nanos, Plot, Rare, RunTime, Stamp, Wall},
        RecordColumn as Column, RecordRow,
    },
    schema::{message, tick},
};

/// The messages of a topic or the ticks of a node, in the order of their numbers.
pub trait Series: Clone + Default + Send + Sync {
    /// A row.
    type Row: RecordRow;
    /// Gives the rows of a run.
    type Tap: Send + 'static;

    /// An empty series for the rows of `tap`.
    fn of(tap: &Self::Tap) -> Self;

    /// The rows without their payloads.
    fn rows(&self) -> &[Self::Row];

    /// The payload of row `index`.
    fn payload(&self, index: usize) -> &[f64];

    /// Adds a row; returns `false` for a payload of another length.
    fn add(&mut self, row: Self::Row, payload: &[f64]) -> bool;

    /// Takes the rows up to run time `until` out of these.
    fn take_until(&mut self, until: Time) -> Self;

    /// Adds the rows that are in `tap`; returns their number.
    fn receive(&mut self, tap: &Self::Tap) -> usize;

    /// Waits for a row and adds all that are in `tap`; `false` at its end.
    fn wait(&mut self, tap: &Self::Tap) -> bool;

    /// Run time of the newest row. Those of several publishers may come out of order.
    fn newest(&self) -> Option<Time> {
        self.rows().iter().map(RecordRow::at).max()
    }
}

impl RecordRow for Head {
    const KIND: &'static str = "message";
    const HAS_PAYLOAD: bool = true;
    const COLUMNS: &'static [Column] = &[
        Column::new(message::SEQ, "sequence number", Count),
        Column::new("", "run time", RunTime),
        Column::new(message::STAMP, "stamp", Stamp),
        Column::new(message::DROPPED, "messages dropped by then", Count),
        Column::new(message::ORIGIN, "origin", Nanos),
        Column::new(message::ARRIVES, "delivery", Delivery),
    ];

    fn number(&self) -> u64 {
        self.seq
    }

    fn follows(&self, last: &Self) -> bool {
        self.seq > last.seq && self.dropped >= last.dropped
    }

    fn is_possible(&self) -> bool {
        self.arrives.is_none_or(|arrives| arrives >= self.at)
    }

    fn at(&self) -> Time {
        self.at
    }

    fn cells(&self) -> Vec<Option<u64>> {
        vec![
            Some(self.seq),
            Some(self.at.as_nanos()),
            Some(self.stamp.as_nanos()),
            Some(self.dropped),
            self.origin.map(Time::as_nanos),
            self.arrives.map(Time::as_nanos),
        ]
    }

    fn of(cells: &[Option<u64>]) -> Option<Self> {
        let &[seq, at, stamp, dropped, origin, arrives] = cells else {
            return None;
        };
        Some(Self {
            seq: seq?,
            at: Time::from_nanos(at?),
            stamp: Time::from_nanos(stamp?),
            dropped: dropped?,
            origin: origin.map(Time::from_nanos),
            arrives: arrives.map(Time::from_nanos),
        })
    }
}

impl RecordRow for TickRecord {
    const KIND: &'static str = "tick";
    const HAS_PAYLOAD: bool = false;
    const COLUMNS: &'static [Column] = &[
        Column::new(tick::NUMBER, "number", Count),
        Column::new("", "run time", RunTime),
        Column::new(tick::OVERRUNS, "overruns by then", Count),
        Column::new("", "lateness", Plot),
        Column::new(tick::TOOK, "duration", Wall),
        Column::new(tick::PUSHED, "what it applied, at", Rare),
        Column::new(tick::SENSED, "what it applied, sensed at", Rare),
    ];

    fn number(&self) -> u64 {
        self.number
    }

    fn follows(&self, last: &Self) -> bool {
        self.number > last.number && self.at >= last.at && self.overruns >= last.overruns
    }

    fn is_possible(&self) -> bool {
        self.push.is_none_or(|push| push.at >= self.at)
    }

    fn at(&self) -> Time {
        self.at
    }

    fn cells(&self) -> Vec<Option<u64>> {
        let nanos = |duration: Option<Duration>| duration.map(|d| d.as_nanos() as u64);
        vec![
            Some(self.number),
            Some(self.at.as_nanos()),
            Some(self.overruns),
            nanos(self.lateness),
            nanos(self.took),
            self.push.map(|push| push.at.as_nanos()),
            self.push.map(|push| push.sensed.as_nanos()),
        ]
    }

    fn of(cells: &[Option<u64>]) -> Option<Self> {
        let &[number, at, overruns, lateness, took, pushed, sensed] = cells else {
            return None;
        };
        let push = pushed.zip(sensed).map(|(at, sensed)| Push {
            at: Time::from_nanos(at),
            sensed: Time::from_nanos(sensed),
        });
        let tick = Self {
            number: number?,
            at: Time::from_nanos(at?),
            ends: at.map(Time::from_nanos),
            lateness: lateness.map(Duration::from_nanos),
            took: took.map(Duration::from_nanos),
            overruns: overruns?,
            push,
        };
        (pushed.is_some() == sensed.is_some()).then_some(tick)
    }
}

impl Series for Rows {
    type Row = Head;
    type Tap = RowTap;

    fn of(tap: &RowTap) -> Self {
        tap.rows()
    }

    fn rows(&self) -> &[Head] {
        self.heads()
    }

    fn payload(&self, index: usize) -> &[f64] {
        self.row(index)
    }

    fn add(&mut self, head: Head, payload: &[f64]) -> bool {
        if self.is_empty() {
            *self = Self::new(payload.len());
        }
        self.push(head, payload.iter().copied())
    }

    fn take_until(&mut self, until: Time) -> Self {
        self.take_until(until)
    }

    fn receive(&mut self, tap: &RowTap) -> usize {
        tap.take(self)
    }

    fn wait(&mut self, tap: &RowTap) -> bool {
        tap.wait(self)
    }
}

impl Series for Vec<TickRecord> {
    type Row = TickRecord;
    type Tap = Tap<TickRecord>;

    fn of(_: &Tap<TickRecord>) -> Self {
        Self::new()
    }

    fn rows(&self) -> &[TickRecord] {
        self
    }

    fn payload(&self, _: usize) -> &[f64] {
        &[]
    }

    fn add(&mut self, tick: TickRecord, _: &[f64]) -> bool {
        self.push(tick);
        true
    }

    fn take_until(&mut self, until: Time) -> Self {
        let count = self.partition_point(|tick| tick.at <= until);
        let later = self.split_off(count);
        std::mem::replace(self, later)
    }

    fn receive(&mut self, tap: &Tap<TickRecord>) -> usize {
        // Only those present now: a run without pacing fills it as fast as it is emptied.
        let there = tap.items().len();
        self.extend(tap.items().try_iter().take(there));
        there
    }

    fn wait(&mut self, tap: &Tap<TickRecord>) -> bool {
        let first = tap.items().recv();
        self.extend(first);
        self.receive(tap);
        first.is_ok()
    }
}
