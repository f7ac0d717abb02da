//! The items of one topic or one node, in order.

use std::time::Duration;

use ratelab::{Head, Push, Time};
use ratelab_account::{Rows, TickRecord};

use super::difference::{Difference, SeriesItem};

/// Takes the next items of a run; false when no more can come.
pub type Source<'a, T> = Box<dyn FnMut(&mut T) -> bool + Send + 'a>;

/// The items that a run left: all at once.
pub fn left<'a, T: Clone>(items: &'a T) -> Source<'a, T>
where
    &'a T: Send,
{
    let mut rest = Some(items);
    Box::new(move |taken| match rest.take() {
        Some(items) => {
            taken.clone_from(items);
            true
        }
        None => false,
    })
}

/// The recorded items, and those of the new run.
pub trait Series {
    /// Whether these are messages, and not ticks.
    const MESSAGES: bool;

    /// Takes what comes next; false when no more can come.
    fn wait(&mut self) -> bool;

    /// The recorded item with this index; `None` after the last.
    fn recorded(&self, index: usize) -> Option<SeriesItem<'_>>;

    /// The item with this index of what came last; `None` after the last.
    fn computed(&self, index: usize) -> Option<SeriesItem<'_>>;

    /// The first part in which the computed item is not the recorded one.
    fn compare(&self, recorded: usize, computed: usize) -> Option<Difference>;
}

/// The messages of a topic.
pub struct Messages<'a> {
    topic: &'a str,
    fields: &'static [&'static str],
    recorded: &'a Rows,
    source: Source<'a, Rows>,
    computed: Rows,
}

impl<'a> Messages<'a> {
    /// Those of the topic called `topic`: recorded, and out of `source`. The numbers of
    /// each are called `fields`.
    pub fn new(
        topic: &'a str,
        fields: &'static [&'static str],
        recorded: &'a Rows,
        source: Source<'a, Rows>,
    ) -> Self {
        Self {
            topic,
            fields,
            recorded,
            source,
            computed: Rows::new(fields.len()),
        }
    }

    fn item(&self, rows: &Rows, index: usize) -> Option<SeriesItem<'_>> {
        let head = rows.heads().get(index)?;
        Some(SeriesItem {
            of: self.topic,
            kind: "message",
            number: head.seq,
            at: head.at,
        })
    }
}

impl Series for Messages<'_> {
    const MESSAGES: bool = true;

    fn wait(&mut self) -> bool {
        self.computed.clear();
        (self.source)(&mut self.computed)
    }

    fn recorded(&self, index: usize) -> Option<SeriesItem<'_>> {
        self.item(self.recorded, index)
    }

    fn computed(&self, index: usize) -> Option<SeriesItem<'_>> {
        self.item(&self.computed, index)
    }

    fn compare(&self, recorded: usize, computed: usize) -> Option<Difference> {
        let item = self.recorded(recorded)?;
        let heads = self.recorded.heads().get(recorded);
        let heads = heads.zip(self.computed.heads().get(computed));
        let difference = heads.and_then(|(one, other)| compare_heads(&item, one, other));
        difference.or_else(|| {
            let (one, other) = (self.recorded.row(recorded), self.computed.row(computed));
            compare_values(&item, self.fields, one, other)
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
            ("run time", nanos(head.at)),
            ("stamp", nanos(head.stamp)),
            ("delivery", head.arrives.map_or("none".to_owned(), nanos)),
            ("origin", head.origin.map_or("none".to_owned(), nanos)),
            ("messages dropped by then", head.dropped.to_string()),
        ]
    };
    first_of(item, parts(recorded), parts(computed))
}

fn compare_values(
    item: &SeriesItem,
    fields: &[&str],
    recorded: &[f64],
    computed: &[f64],
) -> Option<Difference> {
    let number = |value: Option<&f64>| match value {
        Some(value) => format!("{value:?} ({:#018x})", value.to_bits()),
        None => "nothing".to_owned(),
    };
    let bits = |row: &[f64], index: usize| row.get(index).map(|value| value.to_bits());
    let mut indices = 0..recorded.len().max(computed.len());
    let index = indices.find(|&index| bits(recorded, index) != bits(computed, index))?;
    let field = fields.get(index).copied().unwrap_or("a number more");
    let [recorded, computed] = [recorded, computed].map(|row| number(row.get(index)));
    Some(item.differs(field, recorded, computed))
}

/// The ticks of a node.
pub struct Ticks<'a> {
    node: &'a str,
    recorded: &'a [TickRecord],
    /// Whether it was recorded what they did to the world: not in old files.
    has_pushes: bool,
    source: Source<'a, Vec<TickRecord>>,
    computed: Vec<TickRecord>,
}

impl<'a> Ticks<'a> {
    /// Those of the node called `node`: recorded, and out of `source`.
    pub fn new(
        node: &'a str,
        recorded: &'a [TickRecord],
        source: Source<'a, Vec<TickRecord>>,
    ) -> Self {
        Self {
            node,
            recorded,
            has_pushes: recorded.iter().any(|tick| tick.push.is_some()),
            source,
            computed: Vec::new(),
        }
    }

    fn item(&self, ticks: &[TickRecord], index: usize) -> Option<SeriesItem<'_>> {
        let tick = ticks.get(index)?;
        Some(SeriesItem {
            of: self.node,
            kind: "tick",
            number: tick.number,
            at: tick.at,
        })
    }
}

impl Series for Ticks<'_> {
    const MESSAGES: bool = false;

    fn wait(&mut self) -> bool {
        self.computed.clear();
        (self.source)(&mut self.computed)
    }

    fn recorded(&self, index: usize) -> Option<SeriesItem<'_>> {
        self.item(self.recorded, index)
    }

    fn computed(&self, index: usize) -> Option<SeriesItem<'_>> {
        self.item(&self.computed, index)
    }

    fn compare(&self, recorded: usize, computed: usize) -> Option<Difference> {
        let item = self.recorded(recorded)?;
        let (recorded, computed) = (self.recorded.get(recorded)?, self.computed.get(computed)?);
        // A duration that is no part of the run is the wall's time, and does not come again.
        let (took, ends) = (computed.took.or(recorded.took), recorded.ends);
        let push = computed.push.filter(|_| self.has_pushes);
        let computed = &TickRecord {
            took,
            ends,
            push,
            ..*computed
        };
        if recorded == computed {
            return None;
        }
        let parts = |tick: &TickRecord| {
            let late = |late: Duration| format!("{} ns", late.as_nanos());
            let push =
                |push: Push| format!("at {}, sensed at {}", nanos(push.at), nanos(push.sensed));
            [
                ("number", tick.number.to_string()),
                ("run time", nanos(tick.at)),
                ("lateness", tick.lateness.map_or("none".to_owned(), late)),
                ("duration", tick.took.map_or("none".to_owned(), late)),
                ("overruns by then", tick.overruns.to_string()),
                ("what it applied", tick.push.map_or("none".to_owned(), push)),
            ]
        };
        first_of(&item, parts(recorded), parts(computed))
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
