//! Which topics pass on whose data, by equal stamps.

use std::{collections::HashMap, ops::Range};

use crate::{
    bag::{BagMessage, NO_STAMP},
    numbers::{MS, S, median, spread},
};

/// The most topics whose relations are looked for: with each other one.
pub const MAX_RELATED: usize = 700;

/// Returns whether the messages of a topic have stamps to go by.
pub fn is_stamped(messages: &[BagMessage]) -> bool {
    let mut stamps: Vec<i64> = messages
        .iter()
        .map(|message| message.stamp)
        .filter(|stamp| *stamp != NO_STAMP)
        .collect();
    let (count, stamped) = (messages.len(), stamps.len());
    stamps.sort_unstable();
    stamps.dedup();
    count >= 10 && stamped * 10 > count * 9 && stamps.len() >= 8 && stamps.len() * 50 >= count
}

/// The events of a topic, with their stamps.
#[derive(Clone, Debug, Default)]
pub struct TopicEvents {
    /// When each message was published, on the recorder's clock (ns).
    pub events: Vec<i64>,
    /// The stamp of each, or [`NO_STAMP`].
    pub stamps: Vec<i64>,
    /// Each stamp with the place of a message, in order.
    pub by_stamp: Vec<(i64, usize)>,
    /// Whether its publish times are those of the publisher.
    pub has_source: bool,
    /// Whether its stamps can be gone by.
    pub is_stamped: bool,
    /// The mean length of its messages (bytes).
    pub length: f64,
    /// The largest step that all its stamps keep to (ns); 0 without one.
    pub quantum: i64,
}

impl TopicEvents {
    /// Puts the stamps in order, after a change.
    pub fn sort(&mut self) {
        let stamps = self.stamps.iter().copied().zip(0..);
        self.by_stamp = stamps.filter(|(stamp, _)| *stamp != NO_STAMP).collect();
        self.by_stamp.sort_unstable();
    }

    /// Finds the quantum of stamps that count from `first_log`.
    pub fn find_quantum(&mut self, first_log: i64) {
        let divides = |quantum: &i64| {
            let is_whole = |(stamp, _): &&(i64, usize)| (stamp + first_log) % quantum == 0;
            let whole = self.by_stamp.iter().filter(is_whole).count();
            whole * 100 > self.by_stamp.len() * 99
        };
        let found = [100 * MS, 10 * MS, MS].into_iter().find(divides);
        self.quantum = found.unwrap_or(0);
    }

    /// Returns the first message of each stamp.
    pub fn firsts(&self) -> impl Iterator<Item = (i64, usize)> {
        let mut last = NO_STAMP;
        self.by_stamp.iter().copied().filter(move |(stamp, _)| {
            let is_new = *stamp != last;
            last = *stamp;
            is_new
        })
    }

    /// Returns where the messages with `stamp` are in `by_stamp`.
    pub fn with_stamp(&self, stamp: i64) -> Range<usize> {
        let first = self.by_stamp.partition_point(|(other, _)| *other < stamp);
        let rest = &self.by_stamp[first..];
        let count = rest.iter().take_while(|(other, _)| *other == stamp).count();
        first..first + count
    }

    /// Returns the least and the greatest stamp.
    pub fn range(&self) -> Option<(i64, i64)> {
        Some((self.by_stamp.first()?.0, self.by_stamp.last()?.0))
    }

    /// Returns messages per second.
    fn rate(&self) -> f64 {
        let length = self
            .events
            .last()
            .zip(self.events.first())
            .map_or(0, |(last, first)| last - first);
        self.events.len().saturating_sub(1) as f64 / (length.max(1) as f64 / S as f64)
    }
}

/// Two topics with equal stamps.
#[derive(Clone, Copy, Debug)]
pub struct Relation {
    /// The part of the child's stamps that the parent has.
    pub share: f64,
    /// The median of the time from the parent's message to the child's (ns).
    pub delay: f64,
    /// What lies between its 10th and 90th percentile (ns).
    pub spread: i64,
    /// The part of the child's messages that came later.
    pub later: f64,
}

impl Relation {
    /// Creates the relation from `a` to `b`; `None` without one.
    pub fn new(a: &TopicEvents, b: &TopicEvents) -> Option<Self> {
        let (least, greatest) = a.range()?;
        let mut delays = Vec::new();
        let mut within = 0_usize;
        let mut of_a = a.firsts().peekable();
        for (stamp, place) in b.firsts() {
            if stamp < least || stamp > greatest {
                continue;
            }
            within += 1;
            while of_a.next_if(|(other, _)| *other < stamp).is_some() {}
            if let Some((_, other)) = of_a.next_if(|(other, _)| *other == stamp) {
                delays.push(b.events[place] - a.events[other]);
            }
        }
        let count = delays.len();
        let share = count as f64 / within.max(1) as f64;
        let chance = (a.rate() * (a.quantum as f64 / S as f64)).min(1.0);
        if count < 8 || share < 0.5 || share - chance < 0.3 {
            return None;
        }
        let later = delays.iter().filter(|delay| **delay > 0).count();
        Some(Self {
            share,
            later: later as f64 / count as f64,
            spread: spread(&mut delays),
            delay: median(delays),
        })
    }

    /// Returns whether both messages of such a pair are published at once.
    pub fn is_at_once(&self, have_source: bool) -> bool {
        is_at_once(self.delay, self.spread, have_source)
    }
}

/// Returns whether messages with this delay and its spread (ns) are published at once.
pub fn is_at_once(delay: f64, spread: i64, have_source: bool) -> bool {
    let (near, narrow) = if have_source {
        (0.3 * MS as f64, 3 * MS / 10)
    } else {
        (MS as f64, 2 * MS)
    };
    delay.abs() < near && spread < narrow
}

/// The relations of all topics, and the topics of one node.
#[derive(Clone, Debug, Default)]
pub struct Relations {
    /// By parent and child.
    pub all: HashMap<(usize, usize), Relation>,
    /// The leader of each topic: itself, but for twins.
    pub leaders: Vec<usize>,
}

impl Relations {
    /// Finds those of `series`, whose names are `names`.
    pub fn new(series: &[TopicEvents], names: &[String]) -> Self {
        let mut all = HashMap::new();
        for (one, other) in common(series) {
            for (a, b) in [(one, other), (other, one)] {
                let found = Relation::new(&series[a], &series[b]);
                all.extend(found.map(|relation| ((a, b), relation)));
            }
        }
        let mut relations = Self {
            all,
            leaders: (0..series.len()).collect(),
        };
        relations.find_leaders(series, names);
        relations
    }

    /// Returns whether one node published both.
    pub fn are_together(&self, series: &[TopicEvents], a: usize, b: usize) -> bool {
        let have_source = series[a].has_source && series[b].has_source;
        let both = [self.all.get(&(a, b)), self.all.get(&(b, a))];
        let mut both = both.into_iter().flatten();
        both.any(|of| of.share > 0.9 && of.is_at_once(have_source))
    }

    fn are_twins(&self, series: &[TopicEvents], a: usize, b: usize) -> bool {
        let shares = |a, b| self.all.get(&(a, b)).is_some_and(|of| of.share > 0.9);
        let (one, other) = (series[a].events.len(), series[b].events.len());
        let allowed = 0.03 * one.max(other) as f64 + 2.0;
        one.abs_diff(other) as f64 <= allowed
            && shares(a, b)
            && shares(b, a)
            && self.are_together(series, a, b)
    }

    fn find_leaders(&mut self, series: &[TopicEvents], names: &[String]) {
        let mut pairs: Vec<(usize, usize)> = self.all.keys().copied().collect();
        pairs.retain(|(a, b)| a < b && self.are_twins(series, *a, *b));
        pairs.sort_unstable();
        let is_before = |one: usize, other: usize| {
            let lengths = series[other].length.total_cmp(&series[one].length);
            lengths.then_with(|| names[one].cmp(&names[other])).is_lt()
        };
        for (a, b) in pairs {
            let (a, b) = (self.leaders[a], self.leaders[b]);
            let (leader, other) = if is_before(a, b) { (a, b) } else { (b, a) };
            let of_other = self.leaders.iter_mut().filter(|of| **of == other);
            of_other.for_each(|of| *of = leader);
        }
    }

    /// Returns the topics whose data `b` may pass on.
    pub fn candidates(&self, series: &[TopicEvents], b: usize) -> Vec<usize> {
        let is_leader = |topic: usize| self.leaders[topic] == topic;
        let candidates = (0..series.len()).filter(|a| {
            let relation = self.all.get(&(*a, b));
            *a != b
                && is_leader(*a)
                && relation.is_some_and(|relation| relation.later >= 0.95)
                && !self.are_together(series, *a, b)
        });
        candidates.collect()
    }
}

/// Returns the pairs of topics with eight stamps or more in common.
fn common(series: &[TopicEvents]) -> Vec<(usize, usize)> {
    let stamped = series
        .iter()
        .enumerate()
        .filter(|(_, of)| of.is_stamped)
        .take(MAX_RELATED);
    let mut stamps: Vec<(i64, usize)> = stamped
        .flat_map(|(topic, of)| of.firsts().map(move |(stamp, _)| (stamp, topic)))
        .collect();
    stamps.sort_unstable();
    let mut counts: HashMap<(usize, usize), usize> = HashMap::new();
    for equal in stamps.chunk_by(|one, other| one.0 == other.0) {
        for (place, (_, one)) in equal.iter().enumerate() {
            for (_, other) in &equal[place + 1..] {
                *counts.entry((*one, *other)).or_default() += 1;
            }
        }
    }
    let mut pairs: Vec<(usize, usize)> = counts
        .into_iter()
        .filter(|(_, count)| *count >= 8)
        .map(|(pair, _)| pair)
        .collect();
    pairs.sort_unstable();
    pairs
}
