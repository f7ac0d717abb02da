//! The rows of a run, and series of their numbers.

use std::time::Duration;

use ratelab::{Derived, Head, MessageId, Push, TickId, Time, Topology};
use ratelab_metrics::{Rows, RunRow, Tap, TickCauses, TickRecord, TopicRead};

use super::row::{
    ColumnForm::{Count, Delivery, Nanos, Plot, Rare, RareCount, RunTime, Stamp, Wall},
    ListColumn, RecordColumn as Column, RecordRow,
};

/// The messages of a topic or the ticks of a node, in the order of their numbers.
pub trait Series {
    /// A row.
    type Row: RecordRow;

    /// Returns the rows without their payloads.
    fn rows(&self) -> &[Self::Row];

    /// Returns the payload of row `index`.
    fn payload(&self, index: usize) -> &[f64];

    /// Adds a row; returns `false` for a payload of another length.
    fn add(&mut self, row: Self::Row, payload: &[f64]) -> bool;

    /// Returns the run time of the newest row. Rows of several publishers may come out of order.
    fn newest(&self) -> Option<Time> {
        self.rows().iter().map(RecordRow::at).max()
    }
}

impl RecordRow for Head {
    const KIND: &'static str = "message";
    const HAS_PAYLOAD: bool = true;
    const COLUMNS: &'static [Column] = &[
        // Position in the topic's history.
        Column::new("seq", "sequence number", Count),
        Column::new("", "run time", RunTime),
        Column::new("stamp_ns", "stamp", Stamp),
        // Messages of the topic lost unread.
        Column::new("dropped", "messages dropped by then", Count),
        // Run time of the sensing it was derived from.
        Column::new("origin_ns", "origin", Nanos),
        Column::new("arrives_ns", "delivery", Delivery),
        // The tick that published it, and the message that the node derived it from, where it
        // names one.
        Column::new("by_node", "node that published it", RareCount),
        // Less its own number: of a node that publishes in each tick always the same.
        Column::new(
            "by_tick",
            "tick that published it, less its own number",
            RareCount,
        ),
        Column::new("from_topic", "topic that it was derived from", RareCount),
        // Without a topic: it was derived from none, and its data begin with the tick.
        Column::new("from_seq", "message that it was derived from", RareCount),
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
            self.by.map(|by| by.node as u64),
            self.by.map(|by| by.number.wrapping_sub(self.seq)),
            self.from.message().map(|from| from.topic as u64),
            match self.from {
                Derived::Reads => None,
                Derived::Message(from) => Some(from.seq),
                Derived::Nothing => Some(0),
            },
        ]
    }

    fn is_in(&self, topology: &Topology) -> bool {
        let Self { by, from, .. } = self;
        by.is_none_or(|by| by.node < topology.nodes.len())
            && from
                .message()
                .is_none_or(|from| from.topic < topology.topics.len())
    }

    fn from_cells(cells: &[Option<u64>], _: &[u64]) -> Option<Self> {
        let &[
            seq,
            at,
            stamp,
            dropped,
            origin,
            arrives,
            node,
            tick,
            topic,
            from,
        ] = cells
        else {
            return None;
        };
        let by = node.zip(tick).map(|(node, number)| TickId {
            node: node as usize,
            number: number.wrapping_add(seq.unwrap_or_default()),
        });
        let from = match (topic, from) {
            (None, None) => Derived::Reads,
            (Some(topic), Some(seq)) => Derived::Message(MessageId {
                topic: topic as usize,
                seq,
            }),
            (None, Some(0)) => Derived::Nothing,
            _ => return None,
        };
        (node.is_some() == tick.is_some()).then_some(Self {
            by,
            from,
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
        Column::new("tick", "number", Count),
        Column::new("", "run time", RunTime),
        // Periods skipped.
        Column::new("overruns", "overruns by then", Count),
        Column::new("", "lateness", Plot),
        Column::new("took_ns", "duration", Wall),
        // Its action on the world, if it had one, and the sensing behind that.
        Column::new("pushed_ns", "what it applied, at", Rare),
        Column::new("sensed_ns", "what it applied, sensed at", Rare),
        // The topic whose message completed the set that it is for.
        Column::new("completed_by", "topic that completed its set", RareCount),
    ];
    // Four numbers for each message that it read: topic, sequence number less that of the tick, place
    // of the reader, and how many newer ones were there.
    const LIST: Option<ListColumn> = Some(ListColumn {
        name: "reads",
        what: "what it read",
    });

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
            self.causes.completed.map(|topic| topic as u64),
        ]
    }

    fn list(&self) -> Vec<u64> {
        let reads = self.causes.reads.iter().flat_map(|read| {
            let MessageId { topic, seq } = read.message;
            let newer = read.newest.saturating_sub(seq);
            let apart = seq.wrapping_sub(self.number);
            [topic as u64, apart, read.reader as u64, newer]
        });
        reads.collect()
    }

    fn is_in(&self, topology: &Topology) -> bool {
        let mut topics = self
            .causes
            .reads
            .iter()
            .map(|read| read.message.topic)
            .chain(self.causes.completed);
        topics.all(|topic| topic < topology.topics.len())
    }

    fn from_cells(cells: &[Option<u64>], list: &[u64]) -> Option<Self> {
        let &[
            number,
            at,
            overruns,
            lateness,
            took,
            pushed,
            sensed,
            completed,
        ] = cells
        else {
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
            causes: TickCauses {
                reads: reads_in(list, number?)?,
                completed: completed.map(|topic| topic as usize),
            },
        };
        (pushed.is_some() == sensed.is_some()).then_some(tick)
    }
}

/// Returns the reads in the list of a tick; `None` if it has a part of one.
fn reads_in<Reads: FromIterator<TopicRead>>(list: &[u64], tick: u64) -> Option<Reads> {
    let (reads, []) = list.as_chunks::<4>() else {
        return None;
    };
    Some(
        reads
            .iter()
            .map(|[topic, apart, reader, newer]| {
                let seq = tick.wrapping_add(*apart);
                TopicRead {
                    message: MessageId {
                        topic: *topic as usize,
                        seq,
                    },
                    reader: *reader as usize,
                    newest: seq.saturating_add(*newer),
                }
            })
            .collect(),
    )
}

impl Series for Rows {
    type Row = Head;

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
}

impl Series for Vec<TickRecord> {
    type Row = TickRecord;

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
}

/// The rows of a run, or of a part of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunRows {
    /// The messages of the topics, in the order of the [`Topology`]; empty for topics that are
    /// not recorded.
    pub topics: Vec<Rows>,
    /// The ticks of the nodes, in the order of the [`Topology`].
    pub ticks: Vec<Vec<TickRecord>>,
}

impl RunRows {
    /// No rows of a graph with this `topology`.
    pub fn empty(topology: &Topology) -> Self {
        Self {
            topics: vec![Rows::default(); topology.topics.len()],
            ticks: vec![Vec::new(); topology.nodes.len()],
        }
    }

    /// Adds a row of a known topic or node. A message with another number of numbers is none of
    /// its topic.
    pub fn add(&mut self, row: RunRow) {
        match row {
            RunRow::Message(topic, head, numbers) => {
                let topic = self.topics.get_mut(topic);
                let _ = topic.is_some_and(|topic| topic.push(head, numbers));
            }
            RunRow::Tick(node, tick) => {
                if let Some(ticks) = self.ticks.get_mut(node) {
                    ticks.push(tick);
                }
            }
        }
    }

    /// Adds the rows that are in `tap` now, and no later ones: a run without pacing fills it as
    /// fast as it is emptied. Returns their number.
    pub fn receive(&mut self, tap: &Tap<RunRow>) -> usize {
        let there = tap.items().len();
        let rows = tap.items().try_iter().take(there);
        rows.for_each(|row| self.add(row));
        there
    }

    /// Takes the rows up to run time `until` out of these.
    pub fn take_until(&mut self, until: Time) -> Self {
        self.take(|tick| tick.at <= until, until)
    }

    /// Takes what is over by run time `until` out of these: the overruns of a tick that ends later are
    /// those of a run that goes on.
    pub fn take_ended(&mut self, until: Time) -> Self {
        self.take(|tick| tick.ends.unwrap_or(tick.at) <= until, until)
    }

    fn take(&mut self, is_taken: impl Fn(&TickRecord) -> bool, until: Time) -> Self {
        let topics = self.topics.iter_mut().map(|rows| rows.take_until(until));
        let ticks = self.ticks.iter_mut().map(|ticks| {
            let count = ticks.partition_point(&is_taken);
            let later = ticks.split_off(count);
            std::mem::replace(ticks, later)
        });
        Self {
            topics: topics.collect(),
            ticks: ticks.collect(),
        }
    }

    /// Returns the number of messages of each topic, and of ticks of each node.
    pub fn counts(&self) -> [Vec<u64>; 2] {
        let messages = self.topics.iter().map(|rows| rows.len() as u64);
        let ticks = self.ticks.iter().map(|ticks| ticks.len() as u64);
        [messages.collect(), ticks.collect()]
    }

    /// Returns the run time of the newest row; `None` without rows.
    pub fn newest(&self) -> Option<Time> {
        self.topics
            .iter()
            .map(Series::newest)
            .chain(self.ticks.iter().map(Series::newest))
            .flatten()
            .max()
    }
}
