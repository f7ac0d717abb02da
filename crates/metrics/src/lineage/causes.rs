//! What led to a message: the tick that published it, and the messages that this tick had read.
//!
//! All of it is recorded when it happens: a message names its tick, a tick names its reads. This
//! file only joins them.

use std::{cmp::Reverse, collections::VecDeque, iter};

use ratelab::{Derived, Head, MessageId, TickId, Time};
use smallvec::SmallVec;

use super::{DataWay, Lineage, TickPlace, TracedTick, TracedTopic};

/// When the newest data of each node that begins data began (run time), by the indices of the nodes.
pub(super) type Beginnings = SmallVec<[(usize, Time); 2]>;

/// A message of a chain.
pub(super) struct Step<'a> {
    pub(super) message: MessageId,
    /// Without its payload; `None` if it is not known.
    pub(super) sent: Option<&'a Head>,
    /// The tick that published it, with its node and its index among the ticks of the node.
    pub(super) made: Option<(usize, usize, &'a TracedTick)>,
}

impl TracedTopic {
    /// Returns the message with this sequence number.
    pub(super) fn message(&self, seq: u64) -> Option<&Head> {
        let index = place_of(&self.sent, seq, |sent| sent.seq);
        self.sent.get(index).filter(|sent| sent.seq == seq)
    }

    /// Returns the messages published after message number `seq`, oldest first.
    pub(super) fn after(&self, seq: u64) -> impl Iterator<Item = &Head> {
        let next = seq.saturating_add(1);
        self.sent
            .range(place_of(&self.sent, next, |sent| sent.seq)..)
    }

    /// Returns the queue depth at run time `at`.
    pub(super) fn depth(&self, at: Time) -> usize {
        let known = self.depths.iter().rev().find(|(since, _)| *since <= at);
        known.map_or(1, |(_, depth)| depth.get())
    }
}

impl Lineage {
    /// Returns a message that is known.
    pub fn head(&self, message: MessageId) -> Option<&Head> {
        self.topics.get(message.topic)?.message(message.seq)
    }

    /// Returns the index of a tick among the known ticks of its node.
    fn index_of(&self, tick: TickId) -> Option<usize> {
        let ticks = &self.nodes.get(tick.node)?.ticks;
        let index = place_of(ticks, tick.number, |known| known.tick.number);
        let known = ticks.get(index)?;
        (known.tick.number == tick.number).then_some(index)
    }

    /// Returns the tick that published a message.
    pub fn made_by(&self, message: MessageId) -> Option<TickPlace> {
        let by = self.head(message)?.by?;
        Some(TickPlace {
            node: by.node,
            index: self.index_of(by)?,
        })
    }

    /// Returns the messages published by the tick with this index of a node.
    pub fn made(&self, node: usize, index: usize) -> Vec<MessageId> {
        let Some(worked) = self.nodes[node].ticks.get(index) else {
            return Vec::new();
        };
        let number = worked.tick.number;
        let by = Some(TickId { node, number });
        self.topology
            .topics
            .iter()
            .enumerate()
            .filter(|(_, topic)| topic.publishers.contains(&node))
            .flat_map(|(topic, _)| {
                let sent = &self.topics[topic].sent;
                let first = sent.partition_point(|sent| sent.at < worked.tick.at);
                sent.range(first..)
                    .take_while(move |sent| sent.at <= worked.ends())
                    .filter(move |sent| sent.by == by)
                    .map(move |sent| MessageId {
                        topic,
                        seq: sent.seq,
                    })
            })
            .collect()
    }

    /// Returns the messages that carried the data of `message`, newest first. Without a path,
    /// follows the data of `source`.
    pub(super) fn steps(
        &self,
        message: MessageId,
        source: Option<usize>,
    ) -> impl Iterator<Item = Step<'_>> {
        let mut next = Some(message);
        iter::from_fn(move || {
            let step = self.step(next?);
            next = self.behind(&step, source);
            Some(step)
        })
    }

    /// Returns a message with the tick that published it.
    fn step(&self, message: MessageId) -> Step<'_> {
        let sent = self.head(message);
        let by = sent.and_then(|sent| sent.by);
        let made = by.and_then(|by| {
            let index = self.index_of(by)?;
            let worked = &self.nodes[by.node].ticks[index];
            Some((by.node, index, worked))
        });
        Step {
            message,
            sent,
            made,
        }
    }

    /// Returns the message that the data of another one came with, which a tick published; `None`
    /// if they begin with the tick.
    fn behind(&self, step: &Step<'_>, source: Option<usize>) -> Option<MessageId> {
        let (_, _, worked) = step.made?;
        let from = step.sent?.from;
        if from == Derived::Nothing {
            return None;
        }
        let from = from.message();
        let DataWay::Along(path) = &self.way else {
            return from.or_else(|| self.newest_read(worked, source?));
        };
        let place = path.iter().position(|topic| *topic == step.message.topic)?;
        let before = *path.get(place.checked_sub(1)?)?;
        from.filter(|from| from.topic == before)
            .or_else(|| worked.read_of(before))
    }

    /// Of the messages that a tick and those before it read last, the one with the newest data from
    /// the node `source`; of two with the same data the one that came first.
    fn newest_read(&self, worked: &TracedTick, source: usize) -> Option<MessageId> {
        // Most nodes read one topic.
        if let ([read], Some(data)) = (&*worked.reads, &worked.beginnings) {
            return began_of(data, source).map(|_| *read);
        }
        let newest = worked.reads().filter_map(|read| {
            let began = began_of(&self.beginnings_of(read)?, source)?;
            Some(((began, Reverse(self.head(read)?.arrives)), read))
        });
        newest.max_by_key(|(data, _)| *data).map(|(_, read)| read)
    }

    /// Returns the message that a tick of an acting node applied, with the node that began its data
    /// where no path tells the way.
    pub(super) fn applied_by(
        &self,
        node: usize,
        index: usize,
    ) -> Option<(MessageId, Option<usize>)> {
        let worked = &self.nodes[node].ticks[index];
        match &self.way {
            DataWay::Along(path) => Some((worked.read_of(*path.last()?)?, None)),
            DataWay::FromSource(source) => {
                let source = source.or_else(|| self.first_source(worked))?;
                Some((self.newest_read(worked, source)?, Some(source)))
            }
        }
    }

    /// Returns the first node whose data are behind a tick: one that reads nothing, or else one
    /// that says nothing of a sensing.
    fn first_source(&self, worked: &TracedTick) -> Option<usize> {
        let nodes = worked.beginnings.iter().flatten().map(|(node, _)| *node);
        nodes
            .clone()
            .find(|node| self.nodes[*node].begins)
            .or(nodes.clone().next())
    }

    /// Returns when the data of a message began; `None` while the tick that published it is not
    /// settled.
    fn beginnings_of(&self, message: MessageId) -> Option<Beginnings> {
        let Some(sent) = self.head(message) else {
            let topic = self.topics.get(message.topic);
            let newest = topic.and_then(|topic| topic.sent.back());
            let is_to_come = newest.is_some_and(|newest| newest.seq < message.seq);
            return (!is_to_come).then(Beginnings::new); // Otherwise it is forgotten.
        };
        let Some(by) = sent.by else {
            return Some(Beginnings::new()); // From outside of the graph.
        };
        let Some(index) = self.index_of(by) else {
            let newest = self.nodes.get(by.node).and_then(|node| node.ticks.back());
            let is_gone = newest.is_some_and(|newest| newest.tick.number > by.number);
            return is_gone.then(Beginnings::new);
        };
        let worked = &self.nodes[by.node].ticks[index];
        let mut beginnings = match sent.from {
            Derived::Message(from) => self.beginnings_of(from)?,
            Derived::Reads => worked.beginnings.clone()?,
            Derived::Nothing => Beginnings::new(),
        };
        if self.nodes[by.node].begins || sent.from == Derived::Nothing {
            add_newest(&mut beginnings, (by.node, begin_of(sent, worked)));
        }
        Some(beginnings)
    }

    /// Returns the beginnings of all data behind a tick; `None` while the tick behind a message is
    /// not settled.
    fn beginnings_behind(&self, worked: &TracedTick) -> Option<Beginnings> {
        let mut all = Beginnings::new();
        for read in worked.reads() {
            for beginning in self.beginnings_of(read)? {
                add_newest(&mut all, beginning);
            }
        }
        Some(all)
    }

    /// Finds where the data of the newest tick of a node began, if all ticks before it are settled: rows
    /// nearly always come in an order in which that is so.
    pub(super) fn settle_newest(&mut self, node: usize) {
        let newest = self.nodes[node].ticks.len() - 1;
        let is_next = self.nodes[node].settled == newest && !matches!(self.way, DataWay::Along(_));
        self.nodes[node].settled += usize::from(is_next && self.settle_tick(node, newest));
    }

    /// Finds where the data of a tick began; `false` while the ticks behind it have not come.
    fn settle_tick(&mut self, node: usize, index: usize) -> bool {
        let beginnings = self.beginnings_behind(&self.nodes[node].ticks[index]);
        let worked = &mut self.nodes[node].ticks[index];
        worked.beginnings = beginnings;
        worked.beginnings.is_some()
    }

    /// Finds where the data of all ticks began that have come since, as far as the ticks behind
    /// them have come. Along a path nobody asks for it: then it waits until nobody goes along one.
    pub fn settle(&mut self) {
        if matches!(self.way, DataWay::Along(_)) {
            return;
        }
        let mut open: Vec<(Time, usize, usize)> = Vec::new();
        for (node, record) in self.nodes.iter_mut().enumerate() {
            let ticks = record
                .ticks
                .range(record.settled..)
                .enumerate()
                .filter(|(_, worked)| worked.beginnings.is_none());
            open.extend(ticks.map(|(index, tick)| (tick.tick.at, node, record.settled + index)));
        }
        open.sort_unstable();
        // Ticks of one instant may come in any order.
        let mut before = usize::MAX;
        while open.len() < before {
            before = open.len();
            open.retain(|(_, node, index)| !self.settle_tick(*node, *index));
        }
        for record in &mut self.nodes {
            let settled = record
                .ticks
                .range(record.settled..)
                .take_while(|worked| worked.beginnings.is_some());
            record.settled += settled.count();
        }
    }
}

/// Returns when data began with a message that this tick published: as the tick did, or as it ended
/// if the node published then.
pub(super) fn begin_of(sent: &Head, worked: &TracedTick) -> Time {
    if sent.origin.is_some() {
        worked.tick.at
    } else {
        sent.at
    }
}

/// Returns the place of item number `number`, or of the next one. They are in order, and nearly
/// always none is missing.
fn place_of<T>(items: &VecDeque<T>, number: u64, number_of: impl Fn(&T) -> u64) -> usize {
    let first = items.front().map_or(0, &number_of);
    let place = usize::try_from(number.saturating_sub(first)).unwrap_or(usize::MAX);
    match items.get(place) {
        Some(item) if number_of(item) == number => place,
        _ => items.partition_point(|item| number_of(item) < number),
    }
}

/// Returns when the newest data of the node `source` began.
fn began_of(beginnings: &Beginnings, source: usize) -> Option<Time> {
    beginnings
        .iter()
        .find(|(node, _)| *node == source)
        .map(|(_, began)| *began)
}

/// Adds a beginning, unless newer data of that node are known. They stay in the order of the nodes.
fn add_newest(beginnings: &mut Beginnings, (node, began): (usize, Time)) {
    match beginnings.binary_search_by_key(&node, |(known, _)| *known) {
        Ok(place) => beginnings[place].1 = beginnings[place].1.max(began),
        Err(place) => beginnings.insert(place, (node, began)),
    }
}
