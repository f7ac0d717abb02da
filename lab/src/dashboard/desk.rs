//! A run and the person before it: the same for a live run, a recording and a run of other
//! processes.

use std::sync::Arc;

use ratelab::{Event, Knob, KnobKind, Time};
use ratelab_account::Snapshot;
use ratelab_study::system::Setup;

use super::{
    frame::FrameData,
    knob_focus::KnobFocus,
    panes::Panes,
    presets::{DEPTHS, Direction, next_knobs},
    prompt::{Prompt, Vocabulary},
    sampler::{self, RunSource, Sampler},
    view::{Bottom, ScreenState, StatusExtra},
};

/// The notice that no topic can be marked.
pub const NO_TOPIC: &str = "this system has no topic that is read";

/// A run, and how it is looked at.
pub struct Desk<R> {
    /// The run.
    pub run: R,
    /// What is kept of it between frames.
    pub sampler: Sampler,
    /// The visible frame.
    pub frame: Option<Arc<FrameData>>,
    /// The node and the topics of the knob keys.
    pub knob_focus: KnobFocus,
    /// The controls of the panes.
    pub panes: Panes,
    /// The input line for a knob.
    pub prompt: Prompt,
    /// The latest notice of the dashboard.
    pub notice: Option<String>,
    /// Whether to quit.
    pub quit: bool,
}

impl<R: RunSource> Desk<R> {
    /// Looks at `run` from now on.
    pub fn new(run: R) -> Self {
        Self {
            run,
            sampler: Sampler::default(),
            frame: None,
            knob_focus: KnobFocus::default(),
            panes: Panes::default(),
            prompt: Prompt::default(),
            notice: None,
            quit: false,
        }
    }

    /// Gives notice.
    pub fn notify(&mut self, notice: impl Into<String>) {
        self.notice = Some(notice.into());
    }

    /// The graph and its counters.
    pub fn graph(&self) -> Snapshot {
        self.run.observer().snapshot()
    }

    /// Takes a frame of the run; returns whether it is a new one.
    pub fn take_frame(&mut self) -> bool {
        let rows = self.run.new_rows();
        let frame = self.sampler.frame_data(&mut self.run, &rows);
        let new = self.frame.as_deref() != Some(&frame);
        self.frame = Some(frame.into());
        new
    }

    /// The words of the run's knobs, with the values for messages of the first alias.
    pub fn vocabulary<'a>(&'a self, choices: &'a [String]) -> Vocabulary<'a> {
        Vocabulary {
            system: self.run.system(),
            graph: self.graph(),
            choices,
        }
    }

    /// The knobs that turn the rate of `node` to the next of `presets`, from what is `wanted`
    /// or else in force.
    ///
    /// # Errors
    /// A notice, if there are none.
    pub fn next_rate(
        &self,
        node: &str,
        wanted: &Setup,
        presets: &[f64],
        direction: Direction,
    ) -> Result<Vec<Knob>, String> {
        let graph = self.graph();
        let runs = || graph.node(node).map(|node| node.hz);
        let Some(hz) = wanted.rate(node).or_else(runs) else {
            return Ok(Vec::new());
        };
        let nodes = [node.to_owned()];
        next_knobs(KnobKind::Rate, &nodes, (presets, hz.get()), direction)
    }

    /// The knobs that turn the depths of the marked topics, all to the same value.
    ///
    /// # Errors
    /// A notice, if there are none.
    pub fn next_depth(&self, wanted: &Setup, direction: Direction) -> Result<Vec<Knob>, String> {
        let topics = &self.knob_focus.topics;
        let first = topics.first().ok_or(NO_TOPIC)?;
        let graph = self.graph();
        let runs = || graph.topic(first).map(|topic| topic.depth.get());
        let wanted = wanted.depth(first).map(|depth| depth.get());
        let Some(depth) = wanted.or_else(runs) else {
            return Ok(Vec::new());
        };
        let current = (&DEPTHS[..], depth as f64);
        next_knobs(KnobKind::Depth, topics, current, direction)
    }

    /// The screen at run time `now`, with the `events` up to then; `None` before the first
    /// frame.
    pub fn screen(&self, now: Time, events: Vec<Event>) -> Option<ScreenState<'_>> {
        let system = self.run.system();
        Some(ScreenState {
            system,
            frame: self.frame.as_deref()?,
            trace: self.sampler.trace(system, now, &events),
            timeline: sampler::timeline(&self.run, self.panes.timeline, now),
            knot: None,
            knob_focus: self.knob_focus.clone(),
            events,
            extra: StatusExtra {
                ended: self.run.summary().is_some(),
                ..StatusExtra::default()
            },
            focus: self.panes.focus,
            zoomed: self.panes.zoomed,
            scrubber: None,
            map: None,
            page: None,
            aside: None,
            bottom: Bottom {
                hints: Vec::new(),
                prompt: self.prompt.line(system),
                notice: self.notice.as_deref(),
            },
        })
    }
}
