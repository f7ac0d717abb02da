//! What a recording holds of one topic or one node, in order.

use std::{marker::PhantomData, time::Duration};

use ratelab::runtime::{Fields, Payload, TapMessage, TickRecord, Time};

use super::difference::{Difference, SeriesItem};
use crate::recording::topic_record::{Head, TopicRecord};

/// What was recorded, to be compared with what a tap gives when it is run again.
pub trait Series {
    /// What the tap gives.
    type Computed;

    /// The item with this index; `None` after the last.
    fn item(&self, index: usize) -> Option<SeriesItem<'_>>;

    /// Which item `computed` is.
    fn item_of(&self, computed: &Self::Computed) -> SeriesItem<'_>;

    /// The first thing in which `computed` is not the item with this index.
    fn compare(&self, index: usize, computed: &Self::Computed) -> Option<Difference>;
}

/// The messages of a topic.
pub struct Messages<'a, T> {
    topic: &'a str,
    track: &'a TopicRecord,
    payload: PhantomData<fn() -> T>,
}

impl<'a, T> Messages<'a, T> {
    /// Those of the topic called `topic`.
    pub fn of(topic: &'a str, track: &'a TopicRecord) -> Self {
        Self {
            topic,
            track,
            payload: PhantomData,
        }
    }

    fn named(&self, number: u64, at: Time) -> SeriesItem<'_> {
        SeriesItem {
            of: self.topic,
            kind: "message",
            number,
            at,
        }
    }
}

impl<T: Fields + Payload> Series for Messages<'_, T> {
    type Computed = TapMessage<T>;

    fn item(&self, index: usize) -> Option<SeriesItem<'_>> {
        let head = self.track.heads.get(index)?;
        Some(self.named(head.seq, head.stamp))
    }

    fn item_of(&self, computed: &TapMessage<T>) -> SeriesItem<'_> {
        self.named(computed.message.seq, computed.message.stamp)
    }

    fn compare(&self, index: usize, computed: &TapMessage<T>) -> Option<Difference> {
        let message = &computed.message;
        let head = Head {
            stamp: message.stamp,
            seq: message.seq,
            origin: message.origin,
            dropped: computed.dropped,
        };
        let item = self.item(index)?;
        compare_heads(&item, self.track.heads.get(index)?, &head).or_else(|| {
            let mut row = Vec::with_capacity(T::FIELDS.len());
            message.data.append_to(&mut row);
            compare_values::<T>(&item, self.track.row(index), &row)
        })
    }
}

fn compare_heads(item: &SeriesItem, recorded: &Head, computed: &Head) -> Option<Difference> {
    if recorded == computed {
        return None; // Almost always.
    }
    let parts = |head: &Head| {
        [
            ("sequence number", head.seq.to_string()),
            ("stamp", nanos(head.stamp)),
            ("origin", head.origin.map_or("none".to_owned(), nanos)),
            ("messages dropped by then", head.dropped.to_string()),
        ]
    };
    first_of(item, parts(recorded), parts(computed))
}

fn compare_values<T: Fields>(
    item: &SeriesItem,
    recorded: &[f64],
    computed: &[f64],
) -> Option<Difference> {
    let number = |value: Option<&f64>| match value {
        Some(value) => format!("{value:?} ({:#018x})", value.to_bits()),
        None => "nothing".to_owned(),
    };
    let bits = |row: &[f64], index: usize| row.get(index).map(|value| value.to_bits());
    let mut fields = 0..recorded.len().max(computed.len());
    let index = fields.find(|&index| bits(recorded, index) != bits(computed, index))?;
    let field = T::FIELDS.get(index).copied().unwrap_or("a number more");
    let [recorded, computed] = [recorded, computed].map(|row| number(row.get(index)));
    Some(item.differs(field, recorded, computed))
}

/// The ticks of a node.
pub struct Ticks<'a> {
    /// Its name.
    pub node: &'a str,
    /// Those that were recorded.
    pub ticks: &'a [TickRecord],
}

impl Ticks<'_> {
    fn named(&self, tick: &TickRecord) -> SeriesItem<'_> {
        SeriesItem {
            of: self.node,
            kind: "tick",
            number: tick.number,
            at: tick.at,
        }
    }
}

impl Series for Ticks<'_> {
    type Computed = TickRecord;

    fn item(&self, index: usize) -> Option<SeriesItem<'_>> {
        self.ticks.get(index).map(|tick| self.named(tick))
    }

    fn item_of(&self, computed: &TickRecord) -> SeriesItem<'_> {
        self.named(computed)
    }

    fn compare(&self, index: usize, computed: &TickRecord) -> Option<Difference> {
        let recorded = self.ticks.get(index)?;
        // How long a tick took is the wall's time, and not what comes again.
        let took = recorded.took;
        if *recorded == (TickRecord { took, ..*computed }) {
            return None;
        }
        let parts = |tick: &TickRecord| {
            let late = |late: Duration| format!("{} ns", late.as_nanos());
            [
                ("number", tick.number.to_string()),
                ("run time", nanos(tick.at)),
                ("lateness", tick.lateness.map_or("none".to_owned(), late)),
                ("overruns by then", tick.overruns.to_string()),
            ]
        };
        first_of(&self.named(recorded), parts(recorded), parts(computed))
    }
}

/// The first of several parts that are not the same, each by its name.
fn first_of<const N: usize>(
    item: &SeriesItem,
    recorded: [(&str, String); N],
    computed: [(&str, String); N],
) -> Option<Difference> {
    let mut parts = recorded.into_iter().zip(computed);
    let ((part, recorded), (_, computed)) = parts.find(|(one, other)| one != other)?;
    Some(item.differs(part, recorded, computed))
}

/// A run time to the nanosecond.
pub fn nanos(time: Time) -> String {
    format!("{} ns", time.as_nanos())
}
