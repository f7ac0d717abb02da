//! Ticks and messages over a short stretch of a run, and the chain behind one push.

use std::{collections::HashSet, time::Duration};

use ratelab::runtime::{
    Time,
    telemetry::{Chain, Lineage, Sent, Worked},
};

/// Stretches of run time that can be in sight (ms).
const SPANS_MS: [u64; 8] = [20, 50, 100, 200, 500, 1_000, 2_000, 5_000];

/// Where the person looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimelineView {
    /// The push that is looked at, by the run time at which it was first applied; the
    /// newest if `None`.
    pub selected: Option<Time>,
    /// Which of the stretches is in sight.
    zoom: usize,
}

impl Default for TimelineView {
    fn default() -> Self {
        Self {
            selected: None,
            zoom: 4,
        }
    }
}

impl TimelineView {
    /// Shows a shorter stretch, or a longer one.
    pub fn zoom(&mut self, closer: bool) {
        self.zoom = match closer {
            true => self.zoom.saturating_sub(1),
            false => (self.zoom + 1).min(SPANS_MS.len() - 1),
        };
    }

    /// How much run time is in sight.
    fn span(self) -> Duration {
        Duration::from_millis(SPANS_MS[self.zoom])
    }

    /// Selects the push of `node` after the one that is selected, or the one before;
    /// after the last one the newest, whichever that is. `now` is the newest run time.
    pub fn select(&mut self, lineage: &Lineage, node: usize, now: Time, later: bool) {
        let at = self.selected.unwrap_or(now);
        let Some(push) = lineage.push_at(node, at) else {
            return;
        };
        self.selected = match (later, self.selected) {
            (true, None) => None,
            (true, Some(_)) => {
                let newer = lineage.pushes(node).into_iter();
                let mut newer = newer.filter(|newer| newer.since > push.since);
                newer
                    .find(|newer| newer.since <= now)
                    .map(|newer| newer.since)
            }
            (false, _) => {
                let before = Time::ZERO + push.since.since(Time::ZERO + Time::TICK);
                let older = lineage.push_at(node, before);
                older.map(|older| older.since).or(self.selected)
            }
        };
    }
}

/// What is in sight.
#[derive(Clone, Debug, PartialEq)]
pub struct Timeline {
    /// The first run time.
    pub from: Time,
    /// The last run time.
    pub to: Time,
    /// A lane for each node and each topic between them.
    pub lanes: Vec<Lane>,
    /// The age of the selected push and its parts.
    pub sentence: String,
    /// Whether the newest push is looked at.
    pub newest: bool,
}

/// What happened at a node or on a topic.
#[derive(Clone, Debug, PartialEq)]
pub struct Lane {
    /// Its name.
    pub name: String,
    /// What happened, the oldest first.
    pub marks: Vec<Mark>,
}

/// Something that happened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mark {
    /// When it began.
    pub at: Time,
    /// When it was over.
    pub until: Time,
    /// What it was.
    pub kind: MarkKind,
    /// Whether it is behind the selected push.
    pub bright: bool,
}

/// What happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MarkKind {
    /// A tick.
    Tick,
    /// A tick was due and did not begin.
    Late,
    /// Periods were skipped.
    Overrun,
    /// A message that was read.
    Read,
    /// A message without a reader so far.
    Unread,
    /// A message that was lost.
    Lost,
}

impl Timeline {
    /// What `view` shows of a run that has come to `now`, where `acts` is the node whose
    /// push has an age.
    pub fn of(lineage: &Lineage, acts: usize, view: TimelineView, now: Time) -> Option<Self> {
        let looked_at = view.selected.unwrap_or(now).min(now);
        let push = lineage.push_at(acts, looked_at)?;
        let chain = lineage.chain_of(&push);
        let moment = match view.selected {
            None => now,
            Some(_) => push.outdated.unwrap_or(now).clamp(push.since, now),
        };
        // A selected push stands in the last third.
        let to = match view.selected {
            None => now,
            Some(since) => (since + view.span() / 3).min(now.max(since)),
        };
        let from = Time::ZERO + to.since(Time::ZERO + view.span());
        let window = Window { from, to };
        let topology = lineage.topology();
        let order = order(lineage, acts);
        let lanes = order.into_iter().flat_map(|node| {
            let outputs = topology.topics.iter().enumerate();
            let outputs =
                outputs.filter(move |(_, t)| t.publishers.contains(&node) && !t.readers.is_empty());
            let lane = window.node(lineage, node, &chain);
            let chain = &chain;
            std::iter::once(lane)
                .chain(outputs.map(move |(topic, _)| window.topic(lineage, topic, chain)))
        });
        Some(Self {
            from,
            to,
            lanes: lanes.collect(),
            sentence: push.parts(moment).sentence(topology),
            newest: view.selected.is_none(),
        })
    }
}

/// The nodes on the way to the one that acts, and that one.
fn order(lineage: &Lineage, acts: usize) -> Vec<usize> {
    let topics = &lineage.topology().topics;
    let mut order = vec![acts];
    let mut next = 0;
    while let Some(&reader) = order.get(next) {
        let inputs = topics
            .iter()
            .filter(|topic| topic.readers.contains(&reader));
        for node in inputs.flat_map(|topic| topic.publishers.iter().copied()) {
            if !order.contains(&node) {
                order.push(node);
            }
        }
        next += 1;
    }
    order.reverse();
    order
}

/// The run times in sight.
#[derive(Clone, Copy)]
struct Window {
    from: Time,
    to: Time,
}

impl Window {
    fn node(self, lineage: &Lineage, node: usize, chain: &Chain) -> Lane {
        let mut marks = Vec::new();
        let mut before: Option<u64> = None;
        for (index, worked) in lineage.ticks_between(node, self.from, self.to) {
            let Worked { tick, .. } = worked;
            let ends = tick.ends.unwrap_or(self.to);
            let overruns = tick.overruns;
            let more = before
                .replace(overruns)
                .is_some_and(|before| overruns > before);
            if ends < self.from {
                continue;
            }
            let bright = chain.ticks.contains(&(node, index));
            let mut add = |at, until, kind| {
                marks.push(Mark {
                    at,
                    until,
                    kind,
                    bright,
                });
            };
            let late = tick.lateness.unwrap_or_default();
            if !late.is_zero() {
                add(
                    Time::ZERO + tick.at.since(Time::ZERO + late),
                    tick.at,
                    MarkKind::Late,
                );
            }
            add(tick.at, ends, MarkKind::Tick);
            if more {
                add(ends, ends, MarkKind::Overrun);
            }
        }
        Lane {
            name: lineage.topology().nodes[node].name.clone(),
            marks,
        }
    }

    fn topic(self, lineage: &Lineage, topic: usize, chain: &Chain) -> Lane {
        let known = &lineage.topology().topics[topic];
        let readers = known.readers.iter();
        let ticks = readers.flat_map(|&node| lineage.ticks_between(node, self.from, Time::MAX));
        let reads = ticks.flat_map(|(_, worked)| &worked.reads);
        let reads = reads.filter(|(of, _)| *of == topic);
        let read: HashSet<u64> = reads.map(|(_, seq)| *seq).collect();
        let mark = |sent: &Sent| {
            let until = sent.arrives.unwrap_or(sent.released);
            let bright = chain.messages.contains(&(topic, sent.seq));
            let kind = match sent.arrives {
                None => MarkKind::Lost,
                Some(_) if bright || read.contains(&sent.seq) => MarkKind::Read,
                Some(_) => MarkKind::Unread,
            };
            Mark {
                at: sent.released,
                until,
                kind,
                bright,
            }
        };
        let sent = lineage.sent(topic).rev();
        let sent = sent.skip_while(|sent| sent.released > self.to);
        let mut marks: Vec<Mark> = sent.take(4_096).map(mark).collect();
        marks.retain(|mark| mark.until >= self.from);
        marks.reverse();
        Lane {
            name: known.name.clone(),
            marks,
        }
    }
}
