//! Ticks and messages over a short stretch of a run, with the chain behind one push.

use std::{collections::HashSet, time::Duration};

use ratelab::{Head, MessageId, Time, TimeSpan, Topology};
use ratelab_experiment::cause::upstream;
use ratelab_metrics::{Chain, Lineage, PushInForce, TickPlace, TickWait, WaitsFor};
use ratelab_system::PlanBar;

use super::age::PushSentence;

/// Visible stretches of run time (ms).
const SPANS_MS: [u64; 8] = [20, 50, 100, 200, 500, 1_000, 2_000, 5_000];

/// The position and zoom of the timeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimelineView {
    /// The selected push, by the run time of its first application; the newest if `None`.
    pub selected: Option<Time>,
    /// Index of the visible stretch.
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
    /// Zooms to a shorter stretch, or to a longer one.
    pub fn zoom(&mut self, closer: bool) {
        self.zoom = if closer {
            self.zoom.saturating_sub(1)
        } else {
            (self.zoom + 1).min(SPANS_MS.len() - 1)
        };
    }

    /// Returns the length of the visible stretch (run time).
    fn span(self) -> Duration {
        Duration::from_millis(SPANS_MS[self.zoom])
    }

    /// Selects the push of `node` after the selected one, or the one before; after the
    /// last one, always the newest. `now` is the newest run time.
    pub fn select(&mut self, lineage: &Lineage, node: usize, now: Time, later: bool) {
        let at = self.selected.unwrap_or(now);
        let Some(push) = lineage.push_at(node, at) else {
            return;
        };
        self.selected = match (later, self.selected) {
            (true, None) => None,
            (true, Some(_)) => {
                let mut newer = lineage
                    .pushes(node)
                    .into_iter()
                    .filter(|newer| newer.since > push.since);
                newer
                    .find(|newer| newer.since <= now)
                    .map(|newer| newer.since)
            }
            (false, _) => {
                let older = lineage.push_at(node, push.since - Time::RESOLUTION);
                older.map(|older| older.since).or(self.selected)
            }
        };
    }
}

/// The visible part of the timeline.
#[derive(Clone, Debug, PartialEq)]
pub struct Timeline {
    /// Its begin (run time).
    pub from: Time,
    /// Its end (run time).
    pub to: Time,
    /// A lane per node, and per topic between them.
    pub lanes: Vec<Lane>,
    /// The age of the selected push and its parts.
    pub sentence: PushSentence,
    /// Whether the newest push is selected.
    pub newest: bool,
}

/// The marks of a node or a topic.
#[derive(Clone, Debug, PartialEq)]
pub struct Lane {
    /// Its name.
    pub name: String,
    /// Its marks, oldest first.
    pub marks: Vec<Mark>,
}

/// A mark in a lane.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// Begin (run time).
    pub at: Time,
    /// End (run time).
    pub until: Time,
    /// Its kind.
    pub kind: MarkKind,
    /// Whether it belongs to the chain of the selected push.
    pub bright: bool,
    /// The node that had the executor meanwhile, the topic whose message was missing, or the
    /// number of the plan.
    pub by: Option<String>,
}

/// The kind of a mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MarkKind {
    /// A tick.
    Tick,
    /// The delay between a tick's due time and its start.
    Late,
    /// The delay while others had the executor, or until messages matched.
    Waiting,
    /// A part of a tick for which it was set aside for a more urgent one.
    Aside,
    /// Skipped periods.
    Overrun,
    /// A read message.
    Read,
    /// A message not yet read.
    Unread,
    /// A lost message.
    Lost,
    /// A part of a plan that was played.
    Played,
    /// Another part of it.
    Planned,
}

impl Timeline {
    /// Creates the timeline of a run at run time `now`, as `view` shows it; `acts` is the node with
    /// a push age.
    pub fn new(lineage: &Lineage, acts: usize, view: TimelineView, now: Time) -> Option<Self> {
        let looked_at = view.selected.unwrap_or(now).min(now);
        let topology = lineage.topology();
        let push = lineage.push_at(acts, looked_at);
        let mut topics = topology.topics.iter();
        if push.is_none() && topics.any(|topic| topic.readers.contains(&acts)) {
            return None;
        }
        let chain = push
            .as_ref()
            .map(|push| lineage.chain_of(push))
            .unwrap_or_default();
        // A selected push is in the last third.
        let to = match view.selected {
            None => now,
            Some(since) => (since + view.span() / 3).min(now.max(since)),
        };
        let mut timeline = Self {
            from: to - view.span(),
            to,
            lanes: Vec::new(),
            sentence: sentence(lineage, acts, push.as_ref(), view, now),
            newest: view.selected.is_none(),
        };
        for node in order(lineage, acts) {
            timeline.lanes.push(timeline.node(lineage, node, &chain));
            for (index, topic) in topology.topics.iter().enumerate() {
                if topic.publishers.contains(&node) && !topic.readers.is_empty() {
                    timeline.lanes.push(timeline.topic(lineage, index, &chain));
                }
            }
        }
        Some(timeline)
    }

    /// Returns the timeline with these lanes for the bars of plans on `topic`.
    pub fn with_plans(mut self, topic: &str, lanes: &[Vec<PlanBar>]) -> Self {
        for (number, bars) in (1..).zip(lanes) {
            let parts = bars
                .iter()
                .flat_map(|bar| bar.parts.iter().map(move |part| (bar, part)));
            let marks: Vec<Mark> = parts
                .filter(|(_, part)| part.from <= self.to && self.from < part.to)
                .map(|(bar, part)| Mark {
                    at: part.from,
                    until: part.to,
                    kind: if part.played {
                        MarkKind::Played
                    } else {
                        MarkKind::Planned
                    },
                    bright: part.played,
                    by: Some(bar.number.to_string()),
                })
                .collect();
            if !marks.is_empty() {
                let name = format!("{topic} {number}");
                self.lanes.push(Lane { name, marks });
            }
        }
        self
    }
}

/// Returns the age of a push and its parts.
fn sentence(
    lineage: &Lineage,
    acts: usize,
    push: Option<&PushInForce>,
    view: TimelineView,
    now: Time,
) -> PushSentence {
    let topology = lineage.topology();
    let Some(push) = push else {
        let name = &topology.nodes[acts].name;
        return PushSentence(vec![format!(
            "{name} reads no topic: its pushes have no chain"
        )]);
    };
    let moment = match view.selected {
        None => now,
        Some(_) => push.outdated.unwrap_or(now).clamp(push.since, now),
    };
    PushSentence::new(&push.parts(moment), topology)
}

/// Returns the nodes upstream of the acting one, the acting node itself, and the others on the
/// threads of their executors.
fn order(lineage: &Lineage, acts: usize) -> Vec<usize> {
    let topology = lineage.topology();
    let mut order = upstream(topology, acts);
    order.reverse();
    let executors: HashSet<usize> = order
        .iter()
        .filter_map(|&node| topology.nodes[node].executor_index)
        .collect();
    let others: Vec<usize> = topology
        .nodes
        .iter()
        .enumerate()
        .filter(|(node, known)| {
            let index = known.executor_index;
            !order.contains(node) && index.is_some_and(|index| executors.contains(&index))
        })
        .map(|(node, _)| node)
        .collect();
    order.extend(others);
    order
}

/// Its lanes.
impl Timeline {
    fn node(&self, lineage: &Lineage, node: usize, chain: &Chain) -> Lane {
        let mut marks = Vec::new();
        let mut before: Option<u64> = None;
        for (index, worked) in lineage.ticks_within(node, TimeSpan::new(self.from, self.to)) {
            let overruns = worked.tick.overruns;
            let overruns_before = before.replace(overruns);
            let ends = worked.tick.ends.unwrap_or(self.to);
            if ends < self.from {
                continue;
            }
            let mark = |[at, until]: [Time; 2], kind, by| Mark {
                at,
                until,
                kind,
                bright: chain.ticks.contains(&TickPlace { node, index }),
                by,
            };
            let wait = |wait: TickWait, kind| {
                let by = missing(wait.what, lineage.topology());
                mark([wait.from, wait.to], kind, by)
            };
            let waits = lineage.waits(node, index).into_iter();
            marks.extend(waits.map(|waited| match waited.what {
                WaitsFor::Thread => wait(waited, MarkKind::Late),
                WaitsFor::Match(_) | WaitsFor::Node(_) => wait(waited, MarkKind::Waiting),
            }));
            marks.push(mark([worked.tick.at, ends], MarkKind::Tick, None));
            let asides = lineage.set_aside(node, index).into_iter();
            marks.extend(asides.map(|aside| wait(aside, MarkKind::Aside)));
            if overruns_before.is_some_and(|before| overruns > before) {
                marks.push(mark([ends, ends], MarkKind::Overrun, None));
            }
        }
        Lane {
            name: lineage.topology().nodes[node].name.clone(),
            marks,
        }
    }

    fn topic(&self, lineage: &Lineage, topic: usize, chain: &Chain) -> Lane {
        let known = &lineage.topology().topics[topic];
        let read: HashSet<u64> = known
            .readers
            .iter()
            .flat_map(|&node| lineage.ticks_within(node, TimeSpan::new(self.from, Time::MAX)))
            .flat_map(|(_, worked)| worked.reads())
            .filter(|read| read.topic == topic)
            .map(|read| read.seq)
            .collect();
        let mark = |sent: &Head| {
            let until = sent.arrives.unwrap_or(sent.at);
            let seq = sent.seq;
            let bright = chain.messages.contains(&MessageId { topic, seq });
            let kind = match sent.arrives {
                None => MarkKind::Lost,
                Some(_) if bright || read.contains(&sent.seq) => MarkKind::Read,
                Some(_) => MarkKind::Unread,
            };
            Mark {
                at: sent.at,
                until,
                kind,
                bright,
                by: None,
            }
        };
        let mut marks: Vec<Mark> = lineage
            .sent(topic)
            .rev()
            .skip_while(|sent| sent.at > self.to)
            .take(4_096)
            .map(mark)
            .collect();
        marks.retain(|mark| mark.until >= self.from);
        marks.reverse();
        Lane {
            name: known.name.clone(),
            marks,
        }
    }
}

/// Returns the name of what a tick waited for, unless it is a thread.
fn missing(what: WaitsFor, topology: &Topology) -> Option<String> {
    match what {
        WaitsFor::Match(topic) => Some(topology.topics[topic].name.clone()),
        WaitsFor::Node(node) => Some(topology.nodes[node].name.clone()),
        WaitsFor::Thread => None,
    }
}
