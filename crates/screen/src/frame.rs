//! One frame of the dashboard: plain figures without locks and handles.
//!
//! It is read from the library's counters once and then stays unchanged: it can be drawn,
//! kept for looking back, and compared with the next frame.

use std::{collections::VecDeque, sync::Arc, time::Duration};

use ratelab::{Hz, Status, Time};
use ratelab_experiment::cause::PlanFacts;
use ratelab_metrics::Distribution;
use ratelab_system::{AgeLimits, Signal};

use crate::age::{AgeData, PushData};

/// The content of the screen, without keys and layout.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameData {
    /// Run time.
    pub now: Time,
    /// Wall time since the run began, in whole seconds.
    pub wall_s: u64,
    /// Clock, speed, and whether run time is paused.
    pub status: Status,
    /// Seed of the start.
    pub seed: u64,
    /// The world, where it is relevant.
    pub world: Option<&'static str>,
    /// The messages in force, such as `policy scripted`.
    pub settings: Vec<String>,
    /// The nodes that stamp by a wrong clock, each with its error, such as `camera (-175 0)`.
    pub wrong_stamps: Vec<String>,
    /// The nodes of the graph, in the order in which they were added.
    pub nodes: Vec<NodeData>,
    /// The topics of the graph.
    pub topics: Vec<TopicData>,
    /// The latency of the system, if measured.
    pub latency: Option<LatencyData>,
    /// The newest plan, if the system plans ahead.
    pub plan: Option<PlanData>,
    /// The recent push age, if the system has one.
    pub age: Option<AgeData>,
    /// Whether the limits of that age are still being computed.
    pub awaits_limits: bool,
    /// The parts of that age, if known.
    pub push: Option<PushData>,
    /// Whether the run equals the previous one so far, bit for bit; `None` without a
    /// previous one.
    pub same: Option<bool>,
    /// The newest state of the plant as numbers; empty before the first.
    pub state: Vec<f64>,
    /// The state of the run, or its result.
    pub verdict: VerdictData,
    /// Number of messages lost because the dashboard was too slow.
    pub telemetry_lost: u64,
}

/// A node.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeData {
    /// Its name.
    pub name: Arc<str>,
    /// Its function in a few words, if the system has them.
    pub caption: Option<&'static str>,
    /// The rate in force.
    pub hz: Hz,
    /// Whether messages trigger it.
    pub triggered: bool,
    /// Ticks so far.
    pub ticks: u64,
    /// Periods skipped during long ticks.
    pub overruns: u64,
    /// Whether it ticked recently.
    pub lit: bool,
    /// Its state.
    pub health: Health,
    /// The process in which it runs, where that is another one.
    pub place: Option<String>,
    /// Lateness of its ticks (real clock only).
    pub lateness: Quantiles,
    /// Duration of its ticks.
    pub tick_time: Quantiles,
}

/// The state of a node.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Health {
    /// It ticks.
    #[default]
    Works,
    /// It crashed, and its last messages are held.
    Crashed,
    /// It is in a tick made long by a knob.
    Hangs,
    /// Its process does not answer.
    Gone,
}

/// The process in which a node runs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// Its name, such as `4242@robot`.
    pub text: String,
    /// Why nothing is heard of it, and what to try; `None` if it reports.
    pub absent: Option<String>,
}

impl Health {
    /// Returns the state in a word of at most `room` columns, or in the shortest word; `None` for a
    /// healthy node.
    pub fn word(self, room: usize) -> Option<&'static str> {
        match self {
            Self::Works => None,
            Self::Crashed if room >= "crashed".len() => Some("crashed"),
            Self::Crashed => Some("dead"),
            Self::Hangs => Some("hangs"),
            Self::Gone => Some("gone"),
        }
    }
}

/// A message in flight on a link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dot {
    /// Position from 0 (publisher) to 1 (readers).
    pub way: f64,
    /// Whether it was lost.
    pub lost: bool,
}

/// A topic.
#[derive(Clone, Debug, PartialEq)]
pub struct TopicData {
    /// Its name.
    pub name: Arc<str>,
    /// Queue depth.
    pub depth: usize,
    /// Messages published so far.
    pub published: u64,
    /// Messages per second over the last second of run time.
    pub per_second: f64,
    /// Messages per second over the whole run.
    pub average: f64,
    /// Messages lost unread so far, summed over all readers.
    pub dropped: u64,
    /// Messages lost unread in about the last second of run time.
    pub dropped_lately: u64,
    /// Messages lost on its link so far.
    pub lost: u64,
    /// Messages lost on its link in about the last second of run time.
    pub lost_lately: u64,
    /// Messages delivered after a newer one.
    pub overtaken: u64,
    /// Messages that matches took and used in no set.
    pub unmatched: u64,
    /// The messages in flight, if its link has a delay.
    pub dots: Option<Vec<Dot>>,
    /// Nodes that publish, as indices into [`FrameData::nodes`].
    pub publishers: Vec<usize>,
    /// Nodes that read, as indices into [`FrameData::nodes`].
    pub readers: Vec<usize>,
    /// Data age at each read.
    pub age: Quantiles,
    /// Age of the message that readers currently hold; `None` before the first.
    pub held: Option<Duration>,
}

impl TopicData {
    /// Recent share of messages lost on its link.
    pub fn link_loss(&self) -> f64 {
        share(self.lost_lately, self.per_second)
    }

    /// Recent share of messages lost unread.
    pub fn loss(&self) -> f64 {
        let read = self.per_second * self.readers.len() as f64;
        share(self.dropped_lately, read)
    }
}

/// Returns the share that was `gone`; zero of none.
fn share(gone: u64, all: f64) -> f64 {
    if all > 0.0 {
        (gone as f64 / all).min(1.0)
    } else {
        0.0
    }
}

/// A distribution in a few figures; all zero without samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quantiles {
    /// Number of samples.
    pub count: u64,
    /// Median.
    pub p50: Duration,
    /// The 99th percentile.
    pub p99: Duration,
    /// Maximum.
    pub max: Duration,
}

impl Quantiles {
    /// Creates the figures of `distribution`.
    pub fn from_distribution(distribution: &Distribution) -> Self {
        Self {
            count: distribution.count(),
            p50: distribution.quantile(0.5).unwrap_or_default(),
            p99: distribution.quantile(0.99).unwrap_or_default(),
            max: distribution.max().unwrap_or_default(),
        }
    }
}

/// The latency of the system.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LatencyData {
    /// Its name, such as `sense→act`.
    pub name: String,
    /// Its figures.
    pub figures: Quantiles,
    /// Counts per bin of width [`LatencyData::bin`]; the last bin counts all longer
    /// latencies.
    pub bins: Vec<u64>,
    /// Bin width.
    pub bin: Duration,
    /// Age of the sensing behind the newest state (s); negative if a node's clock is
    /// ahead.
    pub newest: Option<f64>,
    /// Period of the node with the first rate key, as a reference.
    pub period: Duration,
}

/// The newest plan.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanData {
    /// How it was made, in a word.
    pub kind: &'static str,
    /// Its actions.
    pub actions: Arc<[f64]>,
    /// For the same moments what was played, and what the earlier plan has for moments still
    /// to come; `None` where there is nothing.
    pub around: Vec<Option<f64>>,
    /// Place of the action for now, which may be beyond the last one.
    pub now: usize,
    /// Place of the action for the moment at which it was taken.
    pub taken: usize,
    /// Time until it is over.
    pub left: Duration,
    /// Number of moments without an action so far.
    pub stalls: u64,
    /// Run time of the last one.
    pub stalled: Option<Time>,
    /// Number of actions that it takes until the next plan is there.
    pub needed: usize,
    /// The time from its making on after which it was taken.
    pub delay: Duration,
    /// The last expected delay with an error of an action's period or more, and the real one.
    pub missed: Option<[Duration; 2]>,
    /// The greatest action, in either direction.
    pub most: f64,
}

impl PlanData {
    /// Returns what it tells of the cause of a loss.
    pub fn facts(&self) -> PlanFacts {
        PlanFacts {
            actions: self.actions.len(),
            stalled: self.stalled,
            needed: self.needed,
            delay: self.delay,
            missed: self.missed,
        }
    }

    /// Returns whether at the moment of this `place` just its action was played.
    pub fn is_as_played(&self, place: usize) -> bool {
        let played = self.around.get(place).copied().flatten();
        place <= self.now && played.is_some() && self.actions.get(place).copied() == played
    }
}

/// The state of a run, or its result.
#[derive(Clone, Debug, PartialEq)]
pub struct VerdictData {
    /// Its rating.
    pub standing: Standing,
    /// The state in a word or two, such as `pole fell`.
    pub word: String,
    /// The state in a line, such as "BALANCED so far" or "FELL at 0.84 s".
    pub headline: String,
    /// The reason, in a line or two; empty without a reason.
    pub why: Vec<String>,
}

/// The rating of a run, each with a glyph and a colour of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// Running and well.
    Good,
    /// Running, with an age above the limit of small deviations.
    Warned,
    /// Ended well.
    Done,
    /// Lost.
    Lost,
}

/// Length of the chart of a signal (s of run time).
pub const TRACE_S: f64 = 10.0;

/// A signal over time, for the chart.
#[derive(Clone, Debug)]
pub struct SignalTrace {
    /// The signal.
    pub signal: Signal,
    /// Run time (s) and value, oldest first.
    pub points: Vec<(f64, f64)>,
    /// Run time (s) and push age (ms), oldest first.
    pub ages: Vec<(f64, f64)>,
    /// The limits of the push age.
    pub limits: AgeLimits,
    /// The range of the signal to stay in, if there is a task.
    pub safe: Option<[f64; 2]>,
    /// Run times (s) at which a knob was turned, with a short text.
    pub marks: Vec<(f64, String)>,
    /// The previous run, if there was one.
    pub ghost: Ghost,
}

/// The part of a run kept for comparison with the next.
#[derive(Clone, Debug, Default)]
pub struct Ghost {
    /// Run time (s) and value of the signal, oldest first.
    pub points: Arc<[(f64, f64)]>,
    /// Run time (s) and push age (ms), oldest first.
    pub ages: Arc<[(f64, f64)]>,
}

/// Frames kept: five minutes at 30 a second, some tens of megabytes.
const KEPT: usize = 9_000;

/// The frames of a run so far, and which of them is looked at.
pub struct FrameHistory {
    frames: VecDeque<FrameData>,
    /// The most that are kept.
    most: usize,
    /// Index of the frame looked at; `None` for the newest as it changes.
    back: Option<usize>,
}

impl FrameHistory {
    /// Creates an empty history; it keeps the newest frame only, unless `back` is set.
    pub fn new(back: bool) -> Self {
        Self {
            frames: VecDeque::new(),
            most: if back { KEPT } else { 1 },
            back: None,
        }
    }

    /// Keeps `frame` if it differs from the newest; returns whether it does.
    pub fn add(&mut self, frame: FrameData) -> bool {
        if let Some(newest) = self.frames.back_mut() {
            // A graph at rest adds no frames while wall time passes.
            let before = std::mem::replace(&mut newest.wall_s, frame.wall_s);
            if *newest == frame {
                return before != frame.wall_s;
            }
            newest.wall_s = before;
        }
        if self.frames.len() == self.most {
            self.frames.pop_front();
            self.back = self.back.map(|index| index.saturating_sub(1));
        }
        self.frames.push_back(frame);
        true
    }

    /// Returns the frame looked at; `None` before the first.
    pub fn shown(&self) -> Option<&FrameData> {
        match self.back {
            Some(index) => self.frames.get(index),
            None => self.frames.back(),
        }
    }

    /// Returns the number of the frame in sight, from one, and the number of frames; `None` live.
    pub fn position(&self) -> Option<(usize, usize)> {
        self.back.map(|index| (index + 1, self.frames.len()))
    }

    /// Looks one frame back; false at the oldest.
    pub fn back(&mut self) -> bool {
        let newest = self.frames.len().saturating_sub(1);
        let before = self.back.unwrap_or(newest).checked_sub(1);
        self.back = before.or(self.back);
        before.is_some()
    }

    /// Looks one frame forward; live again at the newest.
    pub fn forward(&mut self) {
        let newest = self.frames.len().saturating_sub(1);
        self.back = self.back.map(|at| at + 1).filter(|at| *at < newest);
    }

    /// Looks at the oldest frame.
    pub fn oldest(&mut self) {
        self.back = (self.frames.len() > 1).then_some(0);
    }

    /// Looks at the newest frame as it changes.
    pub fn live(&mut self) {
        self.back = None;
    }
}
