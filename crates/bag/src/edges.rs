//! Edges that somebody names where stamps are renewed: the child gets the stamps of its parent.

use std::collections::HashMap;

use crate::{
    bag::{Bag, NO_STAMP},
    read::BagError,
    stamps::TopicEvents,
};

/// A topic whose data goes into another one, as its user knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NamedEdge {
    /// The topic that is read.
    pub from: usize,
    /// The topic that is published.
    pub to: usize,
}

impl NamedEdge {
    /// Returns the edge in `text`, such as `/plan > /cmd`, of topics of `bag`.
    ///
    /// # Errors
    /// [`BagError`] if there are no such topics.
    pub fn parse(bag: &Bag, text: &str) -> Result<Self, BagError> {
        let (from, to) = text.split_once('>').ok_or(BagError::NoEdge)?;
        let place = |name: &str| {
            let name = name.trim();
            let place = bag.topics.iter().position(|topic| topic.name == name);
            place.ok_or_else(|| BagError::NoTopic(name.to_owned()))
        };
        let edge = Self {
            from: place(from)?,
            to: place(to)?,
        };
        if edge.from == edge.to {
            return Err(BagError::NoEdge);
        }
        Ok(edge)
    }
}

/// Gives the child of each edge, and all that pass its stamps on, the stamps of its parent: those of
/// the newest message that had arrived.
pub fn apply(series: &mut [TopicEvents], edges: &[NamedEdge], transport: i64) {
    for edge in in_order(edges) {
        let (parent, child) = (&series[edge.from], &series[edge.to]);
        let stamps: Vec<i64> = child
            .events
            .iter()
            .map(|event| {
                let arrived = parent
                    .events
                    .partition_point(|sent| sent.saturating_add(transport) < *event);
                let newest = arrived.checked_sub(1);
                newest.map_or(NO_STAMP, |place| parent.stamps[place])
            })
            .collect();
        let renewed: HashMap<i64, i64> = child
            .stamps
            .iter()
            .copied()
            .zip(stamps.iter().copied())
            .filter(|(old, _)| *old != NO_STAMP)
            .rev()
            .collect();
        series[edge.to].stamps = stamps;
        series[edge.to].is_stamped = series[edge.from].is_stamped;
        series[edge.to].sort();
        for (topic, of) in series.iter_mut().enumerate() {
            if topic == edge.to || topic == edge.from {
                continue;
            }
            let passed = of
                .stamps
                .iter()
                .filter(|stamp| renewed.contains_key(stamp))
                .count();
            if passed * 2 > of.stamps.len() {
                let new = |stamp: &i64| renewed.get(stamp).copied().unwrap_or(NO_STAMP);
                of.stamps = of.stamps.iter().map(new).collect();
                of.sort();
            }
        }
    }
}

/// Returns the edges, each after the edges into its parent.
fn in_order(edges: &[NamedEdge]) -> Vec<NamedEdge> {
    let (mut ordered, mut rest) = (Vec::new(), edges.to_vec());
    while !rest.is_empty() {
        let is_ready = |edge: &NamedEdge| !rest.iter().any(|other| other.to == edge.from);
        let place = rest.iter().position(is_ready).unwrap_or(0);
        ordered.push(rest.remove(place));
    }
    ordered
}
