//! One frame of the dashboard: plain figures without locks and handles.
//!
//! It is read once per frame from the library's counters and does not change afterwards:
//! it can be drawn, kept for looking back, and compared with the next frame.

use std::{sync::Arc, time::Duration};

use ratelab::{
    runtime::{
        Hz, Time,
        telemetry::{Distribution, Stage, Status},
    },
    system::{AgeLimits, Signal},
};

/// Everything that is on the screen but keys and layout.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameData {
    /// Run time.
    pub now: Time,
    /// Wall time since the run began, in whole seconds.
    pub wall_s: u64,
    /// Clock, speed, and whether run time stands still.
    pub status: Status,
    /// Seed of the start.
    pub seed: u64,
    /// The world, where it matters.
    pub world: Option<&'static str>,
    /// The messages that are set, such as `policy scripted`.
    pub settings: Vec<String>,
    /// The nodes of the graph, in the order in which they were added.
    pub nodes: Vec<NodeData>,
    /// The topics of the graph.
    pub topics: Vec<TopicData>,
    /// The latency that matters, if the system has one.
    pub latency: Option<LatencyData>,
    /// The recent push age, if the system has one.
    pub age: Option<AgeData>,
    /// What its age is spent on, if that is known.
    pub push: Option<PushData>,
    /// Whether it is the same as the last run so far, bit for bit; `None` if there was
    /// none.
    pub same: Option<bool>,
    /// The newest state of the plant, as numbers; empty before the first.
    pub state: Vec<f64>,
    /// How it stands, or how it ended.
    pub verdict: VerdictData,
    /// Messages that came too fast for the dashboard.
    pub telemetry_lost: u64,
}

impl FrameData {
    /// Whether `other` is this frame, seen a little later.
    pub fn differs_in_wall_time_only(&self, other: &Self) -> bool {
        let wall_s = other.wall_s;
        Self {
            wall_s,
            ..self.clone()
        } == *other
    }
}

/// A node.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeData {
    /// Its name.
    pub name: Arc<str>,
    /// The rate in force.
    pub hz: Hz,
    /// Ticks so far.
    pub ticks: u64,
    /// Periods skipped because it was still busy.
    pub overruns: u64,
    /// Whether it ticked a moment ago.
    pub lit: bool,
    /// Whether it works.
    pub health: Health,
    /// How late its ticks began (real clock only).
    pub lateness: Quantiles,
    /// How long its ticks took.
    pub tick_time: Quantiles,
}

/// Whether a node works.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Health {
    /// It ticks.
    #[default]
    Works,
    /// It crashed, and its last messages are held.
    Crashed,
    /// Whether it is in a tick that a knob made long.
    Hangs,
}

impl Health {
    /// It in a word of at most `room` columns, or in the shortest, where it is not well.
    pub fn word(self, room: usize) -> Option<&'static str> {
        match self {
            Self::Works => None,
            Self::Crashed if room >= "crashed".len() => Some("crashed"),
            Self::Crashed => Some("dead"),
            Self::Hangs => Some("hangs"),
        }
    }
}

/// A message on its way through a link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dot {
    /// How far it is, from 0 at the publisher to 1 at the readers.
    pub way: f64,
    /// Whether it was lost there.
    pub lost: bool,
}

/// A topic.
#[derive(Clone, Debug, PartialEq)]
pub struct TopicData {
    /// Its name.
    pub name: Arc<str>,
    /// How many messages it keeps.
    pub depth: usize,
    /// Messages published so far.
    pub published: u64,
    /// Messages per second over the last second of run time.
    pub per_second: f64,
    /// Messages per second over the whole run.
    pub average: f64,
    /// Messages lost unread so far, over all readers.
    pub dropped: u64,
    /// Messages lost unread in the last second or so of run time.
    pub dropped_lately: u64,
    /// Messages that its link lost so far.
    pub lost: u64,
    /// Those of the last second or so of run time.
    pub lost_lately: u64,
    /// Messages that its link delivered after a newer one.
    pub overtaken: u64,
    /// The messages on their way, if its link takes time.
    pub dots: Option<Vec<Dot>>,
    /// Nodes that publish, as indices into [`FrameData::nodes`].
    pub publishers: Vec<usize>,
    /// Nodes that read, as indices into [`FrameData::nodes`].
    pub readers: Vec<usize>,
    /// How old messages were when they were read.
    pub age: Quantiles,
    /// Age of the message that readers hold now; `None` before the first.
    pub held: Option<Duration>,
}

impl TopicData {
    /// Share of its messages that its link lost of late.
    pub fn link_loss(&self) -> f64 {
        match self.per_second > 0.0 {
            true => (self.lost_lately as f64 / self.per_second).min(1.0),
            false => 0.0,
        }
    }

    /// Recent share of its messages that were lost unread.
    pub fn loss(&self) -> f64 {
        let read = self.per_second * self.readers.len() as f64;
        if read > 0.0 {
            (self.dropped_lately as f64 / read).min(1.0)
        } else {
            0.0
        }
    }
}

/// A distribution in four figures; empty if there were no samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quantiles {
    /// Samples.
    pub count: u64,
    /// Mean.
    pub mean: Duration,
    /// Median.
    pub p50: Duration,
    /// The 99th percentile.
    pub p99: Duration,
    /// The longest.
    pub max: Duration,
}

impl Quantiles {
    /// The figures of `distribution`.
    pub fn of(distribution: &Distribution) -> Self {
        let mean = distribution.mean_s().unwrap_or(0.0);
        Self {
            count: distribution.count(),
            mean: Duration::from_secs_f64(mean),
            p50: distribution.quantile(0.5).unwrap_or_default(),
            p99: distribution.quantile(0.99).unwrap_or_default(),
            max: distribution.max().unwrap_or_default(),
        }
    }
}

/// The latency that matters.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LatencyData {
    /// Its name, such as `sense→act`.
    pub name: &'static str,
    /// Its figures.
    pub figures: Quantiles,
    /// How often it was how long: equal bins of [`LatencyData::bin`], the
    /// last one counting everything beyond.
    pub bins: Vec<u64>,
    /// Width of a bin.
    pub bin: Duration,
    /// Age of the sensing behind the newest state (s); negative where a node's clock is
    /// ahead.
    pub newest: Option<f64>,
    /// The period of the node whose rate is turned first, as a reference.
    pub period: Duration,
}

/// The recent push age and its limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AgeData {
    /// The mean push age of the last second, or of two periods of the policy.
    pub mean: Duration,
    /// The greatest push age in that time.
    pub greatest: Duration,
    /// The limits of the loop.
    pub limits: AgeLimits,
}

/// What the age of the push in force is spent on.
#[derive(Clone, Debug, PartialEq)]
pub struct PushData {
    /// The parts of its age now, in a sentence.
    pub sentence: String,
    /// The same for a screen of 80 columns.
    pub short: String,
    /// The mean parts of late, from the sensing on.
    pub mean: Vec<(PartKind, Duration)>,
}

/// What a part of an age is spent on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartKind {
    /// Until it is read.
    Waited,
    /// In ticks that take time.
    Worked,
    /// On links.
    Travelled,
    /// In force.
    Held,
}

impl PartKind {
    /// All of them, in the order in which they come.
    pub const ALL: [Self; 4] = [Self::Waited, Self::Worked, Self::Travelled, Self::Held];

    /// What a part of this `stage` is spent on.
    pub fn of(stage: Stage) -> Self {
        match stage {
            Stage::Wait { .. } | Stage::Queue { .. } | Stage::Reuse { .. } => Self::Waited,
            Stage::Cost { .. } => Self::Worked,
            Stage::Link { .. } => Self::Travelled,
            Stage::Held { .. } | Stage::Kept { .. } => Self::Held,
        }
    }

    /// It in a word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Waited => "waited",
            Self::Worked => "worked",
            Self::Travelled => "on the way",
            Self::Held => "held",
        }
    }
}

/// How near a push age is to its limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Strain {
    /// No limit is known.
    Unknown,
    /// Below the limits.
    Borne,
    /// Small deviations grow.
    Swings,
    /// The loop is lost.
    Falls,
}

impl AgeData {
    /// How near the age is to its limits.
    pub fn strain(&self) -> Strain {
        // Where rates alone come to the limit, the mean is that limit.
        let passed = |limit: Option<Duration>| limit.is_some_and(|limit| self.mean + HAIR >= limit);
        match self.limits {
            AgeLimits { falls, .. } if passed(falls) => Strain::Falls,
            AgeLimits { grows, .. } if passed(grows) => Strain::Swings,
            limits if limits == AgeLimits::default() => Strain::Unknown,
            _ => Strain::Borne,
        }
    }

    /// The age at which it falls, or at which small deviations grow.
    pub fn limit(&self) -> Option<Duration> {
        self.limits.falls.or(self.limits.grows)
    }
}

/// Ages that differ by less are the same.
const HAIR: Duration = Duration::from_micros(100);

/// How it stands, or how it ended.
#[derive(Clone, Debug, PartialEq)]
pub struct VerdictData {
    /// How well that is.
    pub standing: Standing,
    /// It in a word or two, such as `pole fell`.
    pub word: String,
    /// It in a line, such as "BALANCED so far" or "FELL at 0.84 s".
    pub headline: String,
    /// Why, in a line or two; empty where there is nothing to explain.
    pub why: Vec<String>,
}

/// How well a run goes or went, each with a glyph and a colour of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// It goes on, and well.
    Good,
    /// It goes on, and its age is beyond what small deviations bear.
    Warned,
    /// It ended well.
    Done,
    /// It is lost.
    Lost,
}

/// A signal over time, for the chart.
#[derive(Clone, Debug)]
pub struct SignalTrace {
    /// The signal.
    pub signal: &'static Signal,
    /// Run time (s) and value, oldest first.
    pub points: Vec<(f64, f64)>,
    /// Run time (s) and push age (ms), oldest first.
    pub ages: Vec<(f64, f64)>,
    /// The limits of the push age.
    pub limits: AgeLimits,
    /// Run times (s) at which a knob was turned, with a short text.
    pub marks: Vec<(f64, String)>,
    /// The run before this one, if there was one.
    pub ghost: Ghost,
}

/// What is kept of a run to be compared with the next.
#[derive(Clone, Debug, Default)]
pub struct Ghost {
    /// Run time (s) and value of the signal, oldest first.
    pub points: Arc<[(f64, f64)]>,
    /// Run time (s) and push age (ms), oldest first.
    pub ages: Arc<[(f64, f64)]>,
}
