//! What is shown: a run here, a recording, or a run of other processes.

use std::ops::{Deref, DerefMut};

use ratelab::{Command, Event, Time};
use ratelab_metrics::Snapshot;
use ratelab_system::acting_node;

use crate::{
    frame::{FrameData, FrameHistory},
    knobs::KnobFocus,
    panes::Panes,
    playback::Playback,
    run::{Remote, RunSource, WatchedRows},
    sampler::Sampler,
    session::Session,
    timeline::{Timeline, TimelineView},
};

/// A run on the screen, and how it is looked at.
pub struct Shown {
    /// The run.
    pub run: ShownRun,
    /// What is kept of it between frames.
    pub sampler: Sampler,
    /// Its frames.
    pub frames: FrameHistory,
    /// Its events so far; all of a recording.
    pub events: Vec<Event>,
    /// The node and the topics of the knob keys.
    pub knob_focus: KnobFocus,
    /// The controls of the panes.
    pub panes: Panes,
}

impl Shown {
    /// Looks at `run` from now on.
    pub fn new(run: ShownRun) -> Self {
        let events = match &run {
            ShownRun::Recorded(playback) => playback.recording().events.clone(),
            _ => Vec::new(),
        };
        Self {
            sampler: Sampler::default(),
            frames: FrameHistory::new(matches!(run, ShownRun::Live(_))),
            run,
            events,
            knob_focus: KnobFocus::default(),
            panes: Panes::default(),
        }
    }

    /// Forgets the run before, apart from what the `sampler` of this one knows of it.
    pub fn begin(&mut self, sampler: Sampler) {
        self.sampler = sampler;
        self.frames = FrameHistory::new(matches!(self.run, ShownRun::Live(_)));
        self.events.clear();
        self.panes.timeline = TimelineView::default();
    }

    /// Marks the node and the topics whose knobs keys turn first.
    pub fn mark_first(&mut self) {
        self.knob_focus = KnobFocus::new(self.run.system(), &self.graph());
    }

    /// Returns the graph and its counters.
    pub fn graph(&self) -> Snapshot {
        self.run.observer().snapshot()
    }

    /// Returns the visible moment; `None` before the first frame.
    pub fn now(&self) -> Option<Time> {
        match &self.run {
            ShownRun::Recorded(playback) => Some(playback.at()),
            _ => self.frames.shown().map(|frame| frame.now),
        }
    }

    /// Takes the events since the last call.
    pub fn new_events(&mut self) -> Vec<Event> {
        let new = self.run.observer().events(self.events.len());
        self.events.extend_from_slice(&new);
        new
    }

    /// Returns a frame of the run, and the rows that are new in it.
    pub fn frame(&mut self) -> (FrameData, Vec<WatchedRows>) {
        let rows = self.run.new_rows();
        let frame = self.sampler.frame_data(&mut *self.run, &rows);
        (frame, rows)
    }

    /// Returns the node whose pushes the timeline shows, if any.
    fn acting(&self) -> Option<usize> {
        acting_node(self.run.system(), self.run.lineage().topology())
    }

    /// Returns the timeline at run time `now`.
    pub fn timeline(&self, now: Time) -> Option<Timeline> {
        let acts = self.acting()?;
        let timeline = Timeline::new(self.run.lineage(), acts, self.panes.timeline, now)?;
        let planning = self.run.system().robot().planning();
        let topic = planning.map_or("", |planning| planning.plans);
        Some(timeline.with_plans(topic, &self.sampler.plans.bars.lanes()))
    }

    /// Selects another push in the timeline; see [`TimelineView::select`].
    pub fn select_push(&mut self, now: Time, later: bool) {
        if let Some(acts) = self.acting() {
            let view = &mut self.panes.timeline;
            view.select(self.run.lineage(), acts, now, later);
        }
    }

    /// Shows the moment `at` of a recording.
    pub fn go(&mut self, at: Time) {
        if let ShownRun::Recorded(playback) = &mut self.run {
            playback.go(at, &mut self.sampler);
        }
    }
}

/// A run that is shown.
pub enum ShownRun {
    /// A run here.
    Live(Box<Session>),
    /// A recording that is played.
    Recorded(Box<Playback>),
    /// A run of other processes.
    Remote(Box<dyn Remote>),
}

impl ShownRun {
    /// Asks for `command`; a recording obeys none.
    pub fn send(&mut self, command: Command) {
        match (self, command) {
            (Self::Live(session), command) => session.send(command),
            (Self::Remote(run), Command::Set(knob)) => run.turn(knob),
            _ => {}
        }
    }
}

impl Deref for ShownRun {
    type Target = dyn RunSource;

    fn deref(&self) -> &Self::Target {
        match self {
            Self::Live(session) => &**session,
            Self::Recorded(playback) => &**playback,
            Self::Remote(run) => &**run,
        }
    }
}

impl DerefMut for ShownRun {
    fn deref_mut(&mut self) -> &mut Self::Target {
        match self {
            Self::Live(session) => &mut **session,
            Self::Recorded(playback) => &mut **playback,
            Self::Remote(run) => &mut **run,
        }
    }
}
