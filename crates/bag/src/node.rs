//! A node: which topic it reads, and whether a message or a timer makes it work.

use crate::{
    numbers::{MS, spread},
    period::EventPeriod,
    stamps::{Relations, TopicEvents},
    timed::{Timed, TimedOutputs},
    triggered::{Triggered, ends_before},
};

/// What makes a node work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// It reads nothing that is in the bag.
    Sensor,
    /// A message.
    Trigger,
    /// A timer.
    Timer,
    /// Two messages with the same stamp.
    Pair,
    /// Neither explains it.
    Unknown,
}

impl Kind {
    /// Returns its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sensor => "sensor",
            Self::Trigger => "trigger",
            Self::Timer => "timer",
            Self::Pair => "pair",
            Self::Unknown => "unknown",
        }
    }
}

/// What a node reads.
#[derive(Clone, Debug)]
pub struct InputOfNode {
    /// The topic.
    pub parent: usize,
    /// The other one of a pair.
    pub other: Option<usize>,
    /// The node as triggered by it.
    pub triggered: Triggered,
    /// The node as a timer that reads it.
    pub timed: Option<Timed>,
    /// The start and the cost of each run of a pair (ns).
    pub paired: Vec<(i64, i64)>,
}

/// The node that publishes a topic.
#[derive(Clone, Debug)]
pub struct BagNode {
    /// The topic.
    pub topic: usize,
    /// What makes it work.
    pub kind: Kind,
    /// How sure that is, up to 1.
    pub confidence: f64,
    /// The period of its outputs.
    pub period: Option<EventPeriod>,
    /// What it reads.
    pub input: Option<InputOfNode>,
}

impl BagNode {
    /// Returns the topic that it reads.
    pub fn parent(&self) -> Option<usize> {
        self.input.as_ref().map(|input| input.parent)
    }

    /// Returns the costs of its runs, in order (ns).
    pub fn costs(&self) -> Vec<i64> {
        let Some(input) = &self.input else {
            return Vec::new();
        };
        if self.kind == Kind::Pair {
            return input.paired.iter().map(|(_, cost)| *cost).collect();
        }
        input.triggered.costs().collect()
    }
}

/// The most topics that a node is tried with.
const MAX_CANDIDATES: usize = 24;

/// What nodes are found in.
#[derive(Clone, Copy, Debug)]
pub struct NodeSearch<'a> {
    /// The events of all topics.
    pub series: &'a [TopicEvents],
    /// How they are related.
    pub relations: &'a Relations,
    /// The quickest transport (ns).
    pub transport: i64,
}

/// A node by one of the topics that it may read.
struct Candidate {
    input: InputOfNode,
    kind: Kind,
    confidence: f64,
    good: f64,
    width: i64,
    delay: f64,
}

impl NodeSearch<'_> {
    /// Returns the node that publishes the topic `b`, whose events have this `period`.
    pub fn node(&self, b: usize, period: Option<EventPeriod>) -> BagNode {
        let series = &self.series[b];
        let mut node = BagNode {
            topic: b,
            kind: Kind::Sensor,
            confidence: 1.0,
            period,
            input: None,
        };
        let candidates = self.relations.candidates(self.series, b);
        let share = |a: usize| self.relations.all.get(&(a, b)).map_or(0.0, |of| of.share);
        let best = candidates.iter().map(|a| share(*a)).fold(0.0, f64::max);
        let mut near: Vec<usize> = candidates
            .into_iter()
            .filter(|a| share(*a) >= best - 0.25)
            .collect();
        let delay = |a: usize| {
            self.relations
                .all
                .get(&(a, b))
                .map_or(f64::MAX, |of| of.delay)
        };
        near.sort_by(|one, other| delay(*one).total_cmp(&delay(*other)));
        near.truncate(MAX_CANDIDATES);
        let before = ends_before(series);
        let found = near.iter().map(|a| self.candidate(*a, b, period, &before));
        let Some(chosen) = chosen(found.collect()) else {
            return node;
        };
        node.kind = chosen.kind;
        node.confidence = chosen.confidence;
        let mut input = chosen.input;
        if chosen.kind != Kind::Timer
            && let Some(pair) = self.pair(&near, b, &before, input.triggered.spread)
        {
            if pair.parent != input.parent {
                let of = self.candidate(pair.parent, b, period, &before);
                input = of.input;
            }
            input.other = Some(pair.other);
            input.paired = pair.runs;
            (node.kind, node.confidence) = (Kind::Pair, 0.9);
        }
        node.input = Some(input);
        node
    }

    /// Returns the node of `b` as one that reads `a`, with what else keeps its thread busy.
    fn candidate(
        &self,
        a: usize,
        b: usize,
        period: Option<EventPeriod>,
        busy: &[i64],
    ) -> Candidate {
        let (of_a, of_b) = (&self.series[a], &self.series[b]);
        let triggered = Triggered::new(of_a, of_b, self.transport, busy);
        let outputs = TimedOutputs::new(of_a, of_b, self.transport, busy, &triggered);
        let is_timed = |period: &EventPeriod| {
            period.sharpness >= 4.0 / (period.events as f64).sqrt() || triggered.repeats > 0.1
        };
        let timed = period.filter(is_timed).map(|period| outputs.timed(period));
        let (timed, of_timer) = timed.unzip();
        let of_outputs = period.map_or(0.0, |period| period.sharpness);
        let sharpness = of_timer.unwrap_or(of_outputs);
        let (kind, confidence) = Evidence {
            triggered: &triggered,
            timed,
            sharpness,
            mean_interval: outputs.mean_interval(),
        }
        .kind();
        let of_timer = timed.filter(|_| kind == Kind::Timer);
        let worst = triggered
            .negative
            .max(triggered.idle)
            .max(triggered.repeats);
        Candidate {
            good: of_timer.map_or(1.0 - worst, |timed| timed.holds),
            width: of_timer.map_or(triggered.spread, |timed| timed.spread),
            delay: self
                .relations
                .all
                .get(&(a, b))
                .map_or(f64::MAX, |of| of.delay),
            input: InputOfNode {
                parent: a,
                other: None,
                triggered,
                timed,
                paired: Vec::new(),
            },
            kind,
            confidence,
        }
    }

    /// Returns the outputs of a node that reads a topic, as outputs of a timer.
    pub fn outputs(&self, node: &BagNode) -> Option<TimedOutputs> {
        let input = node.input.as_ref()?;
        let (a, b) = (&self.series[input.parent], &self.series[node.topic]);
        let before = ends_before(b);
        Some(TimedOutputs::new(
            a,
            b,
            self.transport,
            &before,
            &input.triggered,
        ))
    }

    /// Returns the start and the end of each run of a node, in order (ns).
    pub fn runs(&self, node: &BagNode) -> Vec<(i64, i64)> {
        let Some(input) = &node.input else {
            return Vec::new();
        };
        let events = &self.series[node.topic].events;
        let steps = &input.triggered.steps;
        match (node.kind, input.timed, self.outputs(node)) {
            (Kind::Pair, ..) => input
                .paired
                .iter()
                .map(|(start, cost)| (*start, start + cost))
                .collect(),
            (Kind::Timer, Some(timed), Some(outputs)) => {
                let first = events.first().copied().unwrap_or(0);
                let starts = outputs
                    .runs(timed)
                    .map(|run| first.saturating_add(run.start.round() as i64));
                let ends = steps.iter().map(|step| events[step.output]);
                starts.zip(ends).collect()
            }
            _ => steps
                .iter()
                .filter(|step| step.input.is_some())
                .map(|step| (step.start, events[step.output]))
                .collect(),
        }
    }

    /// Returns the same node again, with its thread `busy` until a time for each output.
    pub fn again(&self, node: &BagNode, busy: &[i64]) -> BagNode {
        let Some(input) = node.input.as_ref().filter(|_| node.kind != Kind::Pair) else {
            return node.clone();
        };
        let found = self.candidate(input.parent, node.topic, node.period, busy);
        BagNode {
            kind: found.kind,
            confidence: found.confidence,
            input: Some(found.input),
            ..node.clone()
        }
    }

    /// Returns the pair of `candidates` that explains `b` much better than one that leaves a
    /// `single` spread of costs.
    fn pair(&self, candidates: &[usize], b: usize, busy: &[i64], single: i64) -> Option<Paired> {
        const MOST: usize = 12;
        let candidates = &candidates[..candidates.len().min(MOST)];
        let is_before = |a, c| {
            let relation = self.relations.all.get(&(a, c));
            relation.is_none_or(|relation| relation.later >= 0.99)
        };
        let mut best: Option<Paired> = None;
        for (place, a) in candidates.iter().enumerate() {
            for c in &candidates[place + 1..] {
                if is_before(*a, *c) || is_before(*c, *a) {
                    continue;
                }
                let pair = self.paired(*a, *c, b, busy);
                let is_better = (pair.spread as f64) < 0.7 * single as f64 && pair.negative < 0.02;
                if is_better && best.as_ref().is_none_or(|best| pair.spread < best.spread) {
                    best = Some(pair);
                }
            }
        }
        best
    }

    /// Returns the runs of `b` as triggered by messages of `a` and `c` with the same stamp.
    fn paired(&self, a: usize, c: usize, b: usize, busy: &[i64]) -> Paired {
        let delay = |topic: usize| {
            self.relations
                .all
                .get(&(topic, b))
                .map_or(0.0, |of| of.delay)
        };
        let (parent, other) = if delay(a) <= delay(c) { (a, c) } else { (c, a) };
        let series = &self.series[b];
        let first = |topic: usize, stamp: i64| {
            let of = &self.series[topic];
            let (_, place) = of.by_stamp.get(of.with_stamp(stamp))?.first()?;
            Some(of.events[*place] + self.transport)
        };
        let runs: Vec<(i64, i64)> = series
            .stamps
            .iter()
            .enumerate()
            .filter_map(|(output, stamp)| {
                let start = first(a, *stamp)?.max(first(c, *stamp)?).max(busy[output]);
                Some((start, series.events[output] - start))
            })
            .collect();
        let mut costs: Vec<i64> = runs.iter().map(|(_, cost)| *cost).collect();
        let negative = costs.iter().filter(|cost| **cost < -3 * MS / 10).count();
        Paired {
            parent,
            other,
            negative: crate::triggered::part(negative, costs.len()),
            spread: spread(&mut costs),
            runs,
        }
    }
}

/// A node as triggered by two topics.
struct Paired {
    parent: usize,
    other: usize,
    spread: i64,
    negative: f64,
    runs: Vec<(i64, i64)>,
}

/// Returns the one of `candidates` that explains the node best.
fn chosen(candidates: Vec<Candidate>) -> Option<Candidate> {
    let best = candidates.iter().map(|of| of.good).fold(0.0, f64::max);
    let near: Vec<Candidate> = candidates
        .into_iter()
        .filter(|of| of.good >= best - 0.1)
        .collect();
    let least = near.iter().map(|of| of.width).min()?;
    let widest = 1.15 * least as f64 + 0.15 * MS as f64;
    let near = near.into_iter().filter(|of| of.width as f64 <= widest);
    near.min_by(|one, other| one.delay.total_cmp(&other.delay))
}

/// The sharpness from which on a period is one, however far costs spread.
const SHARP: f64 = 0.6;

/// What tells a trigger from a timer.
struct Evidence<'a> {
    triggered: &'a Triggered,
    timed: Option<Timed>,
    sharpness: f64,
    mean_interval: f64,
}

impl Evidence<'_> {
    /// Returns the timer, if its grid is one.
    fn grid(&self) -> Option<Timed> {
        let Triggered { repeats, idle, .. } = *self.triggered;
        self.timed.filter(|timed| {
            let is_wide = timed.spread as f64 > 0.75 * timed.period;
            let is_excused =
                repeats > 0.02 || (idle > 0.2 && self.sharpness > 0.4) || self.sharpness > SHARP;
            timed.holds >= 0.85 && (!is_wide || is_excused)
        })
    }

    /// Returns the kind of the node, and how sure it is.
    fn kind(&self) -> (Kind, f64) {
        let Triggered {
            repeats,
            idle,
            negative,
            busy,
            spread,
            half,
            left_out,
            ..
        } = *self.triggered;
        let grid = self.grid();
        let ratio = |of_trigger: i64, of_timer: i64, little: f64| {
            (of_trigger as f64 + little) / (of_timer as f64 + little)
        };
        let (little, of_transport) = (0.02 * MS as f64, 0.5 * MS as f64);
        match grid {
            Some(_) if repeats > 0.02 => return (Kind::Timer, (0.5 + 5.0 * repeats).min(0.99)),
            Some(_) if idle > 0.08 => return (Kind::Timer, 0.95),
            _ if repeats > 0.05 || idle > 0.2 => return (Kind::Unknown, 0.3),
            Some(_) if negative > 0.05 => return (Kind::Timer, 0.5),
            None if negative > 0.05 => return (Kind::Unknown, 0.5),
            _ => {}
        }
        let Some(grid) = grid else {
            let sure = 1.0 - spread as f64 / (2.0 * self.mean_interval);
            return (Kind::Trigger, sure.clamp(0.5, 0.99));
        };
        // Costs of two lengths spread far, though each of them is near one of the two.
        let of_halves = ratio(half, grid.half, of_transport);
        let of_spreads = ratio(spread, grid.spread, little);
        let is_wide = grid.spread > MS / 10;
        if busy > 0.8 && self.sharpness > 0.8 && of_spreads > 0.5 && is_wide {
            return (Kind::Timer, 0.9);
        }
        for ratio in [of_spreads, of_halves] {
            if ratio <= 0.8 {
                return (Kind::Trigger, (1.0 - ratio / 2.0).min(0.99));
            }
            if ratio >= 1.25 {
                return (Kind::Timer, (1.0 - 1.0 / (2.0 * ratio)).min(0.99));
            }
        }
        let outputs = self.triggered.steps.len();
        // A message triggers a node once. A few repeats come from what a recorder lost.
        if repeats > 0.005 {
            return (Kind::Timer, 0.6);
        }
        let is_timer = 2 * left_out > outputs && self.sharpness > 0.8 && is_wide;
        (if is_timer { Kind::Timer } else { Kind::Trigger }, 0.5)
    }
}
