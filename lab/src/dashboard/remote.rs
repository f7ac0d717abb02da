//! The dashboard over a run of other processes: it shows, turns knobs by asking, and leaves
//! without ending the run.

use crossterm::event::KeyEvent;
use ratelab::{Event, Knob, KnobKind};
use ratelab_account::Snapshot;
use ratelab_study::system::KnobText;

use super::{
    frame::{FrameData, SignalTrace},
    keys::{REMOTE, RemoteAction},
    knob_focus::KnobFocus,
    marks::{TRACE_S, marks},
    model::Model,
    panes::Panes,
    presets::{self, Direction},
    prompt::{Prompt, TypesKnobs, Vocabulary},
    sampler::{self, RunSource, Sampler},
    timeline::TimelineView,
    view::{Bottom, ScreenState, StatusExtra},
};
use crate::error::LabError;

/// A run of other processes.
pub trait Remote: RunSource {
    /// Takes what has come; returns whether another run began.
    fn update(&mut self) -> bool;

    /// Asks for a knob to be turned.
    fn turn(&mut self, knob: Knob);

    /// Records the run from now on, or ends the recording; returns a notice.
    fn record(&mut self) -> String;

    /// Number of messages and ticks that the recording lost; `None` without one.
    fn recording(&self) -> Option<u64>;

    /// The last refusal of a knob since the last call.
    fn refusal(&mut self) -> Option<String>;

    /// Whether the run is over.
    fn is_over(&self) -> bool;

    /// What is wrong with the connection, in a few words.
    fn trouble(&self) -> Option<String>;

    /// How exact ages across machines are, unless they are exact.
    fn clocks(&self) -> Option<String>;
}

/// The dashboard's model.
pub struct Watcher<R> {
    run: R,
    sampler: Sampler,
    frame: Option<FrameData>,
    events: Vec<Event>,
    knob_focus: KnobFocus,
    prompt: Prompt,
    panes: Panes,
    notice: Option<String>,
    quit: bool,
}

impl<R: Remote> Watcher<R> {
    /// Shows `run` from now on.
    pub fn new(run: R) -> Self {
        let mut watcher = Self {
            run,
            sampler: Sampler::default(),
            frame: None,
            events: Vec::new(),
            knob_focus: KnobFocus::default(),
            prompt: Prompt::default(),
            panes: Panes::default(),
            notice: None,
            quit: false,
        };
        watcher.begin();
        watcher
    }

    /// Forgets the run before.
    fn begin(&mut self) {
        self.sampler = Sampler::default();
        self.events.clear();
        self.panes.timeline = TimelineView::default();
        self.knob_focus = KnobFocus::new(self.run.system(), &self.graph());
    }

    fn graph(&self) -> Snapshot {
        self.run.observer().read_counters()
    }

    fn act(&mut self, action: RemoteAction) {
        match action {
            RemoteAction::Rate(direction) => self.turn_rate(direction),
            RemoteAction::Depth(direction) => self.turn_depth(direction),
            RemoteAction::Type => self.prompt.open(),
            RemoteAction::Record => {
                let notice = self.run.record();
                self.notify(notice);
            }
            RemoteAction::Panes(action) => {
                let run = (&self.run, self.run.observer().now());
                match self.panes.after(action, self.screen().as_ref(), run) {
                    Ok(panes) => self.panes = panes,
                    Err(notice) => self.notify(notice),
                }
            }
            RemoteAction::Quit => self.quit = true,
        }
    }

    fn turn_rate(&mut self, direction: Direction) {
        let (graph, nodes) = (self.graph(), [self.knob_focus.node.clone()]);
        if let Some(hz) = graph.node(&nodes[0]).map(|node| node.hz.get()) {
            let current = (&presets::RATES[..], hz);
            self.turn(presets::next_knobs(
                KnobKind::Rate,
                &nodes,
                current,
                direction,
            ));
        }
    }

    fn turn_depth(&mut self, direction: Direction) {
        let (graph, topics) = (self.graph(), &self.knob_focus.topics);
        let first = topics.first().and_then(|name| graph.topic(name));
        if let Some(depth) = first.map(|topic| topic.depth as f64) {
            let current = (&presets::DEPTHS[..], depth);
            self.turn(presets::next_knobs(
                KnobKind::Depth,
                topics,
                current,
                direction,
            ));
        }
    }

    /// Turns knobs, or prints the reason why this is impossible.
    fn turn(&mut self, knobs: Result<Vec<Knob>, String>) {
        match knobs {
            Ok(knobs) => knobs.into_iter().for_each(|knob| self.run.turn(knob)),
            Err(reason) => self.notify(reason),
        }
    }

    fn notify(&mut self, notice: impl Into<String>) {
        self.notice = Some(notice.into());
    }

    fn trace(&self) -> Option<SignalTrace> {
        let (system, now) = (self.run.system(), self.run.observer().now());
        let trace = self.sampler.trace(system, now, TRACE_S)?;
        Some(SignalTrace {
            marks: marks(system, self.events.iter(), now),
            ..trace
        })
    }
}

impl<R: Remote> TypesKnobs for Watcher<R> {
    fn prompt(&mut self) -> &mut Prompt {
        &mut self.prompt
    }

    fn vocabulary(&self) -> Vocabulary<'_> {
        Vocabulary {
            system: self.run.system(),
            graph: self.graph(),
            choices: &[],
        }
    }

    fn enter(&mut self, text: &str) -> Result<(), String> {
        let knobs = KnobText(self.run.system().aliases()).parse(text);
        let knobs = knobs.map_err(|why| why.to_string())?;
        knobs.into_iter().for_each(|knob| self.run.turn(knob));
        Ok(())
    }
}

impl<R: Remote> Model for Watcher<R> {
    fn sample(&mut self) -> Result<bool, LabError> {
        if self.run.update() {
            self.begin();
        }
        let refusal = self.run.refusal();
        self.notice = refusal.or(self.notice.take());
        let events = self.run.observer().events(self.events.len());
        self.events.extend(events);
        let rows = self.run.new_rows();
        let frame = Some(self.sampler.frame_data(&mut self.run, &rows));
        self.frame = frame;
        // The time that somebody is gone for goes on, too.
        Ok(true)
    }

    fn screen(&self) -> Option<ScreenState<'_>> {
        let now = self.run.observer().now();
        let (system, frame) = (self.run.system(), self.frame.as_ref()?);
        Some(ScreenState {
            system,
            frame,
            trace: self.trace(),
            timeline: sampler::timeline(&self.run, self.panes.timeline, now),
            knot: None,
            knob_focus: self.knob_focus.clone(),
            events: self.events.clone(),
            extra: StatusExtra {
                recording: self.run.recording(),
                clocks: self.run.clocks(),
                trouble: self.run.trouble(),
                ended: self.run.is_over(),
                ..StatusExtra::default()
            },
            focus: self.panes.focus,
            zoomed: self.panes.zoomed,
            scrubber: None,
            map: None,
            page: self.panes.page(|| REMOTE.rows(|_| true), system, frame),
            aside: None,
            bottom: Bottom {
                hints: REMOTE.hints(|_| true),
                prompt: (self.prompt.is_open()).then(|| self.prompt.line(&self.vocabulary(), None)),
                notice: self.notice.as_deref(),
            },
        })
    }

    fn key(&mut self, key: &KeyEvent) -> Result<(), LabError> {
        self.notice = None;
        let action = REMOTE.action(key);
        let chord = action == Some(RemoteAction::Quit)
            && key.modifiers != crossterm::event::KeyModifiers::NONE;
        if self.prompt.is_open() && !chord {
            self.type_key(key);
            return Ok(());
        }
        match action {
            Some(RemoteAction::Quit) => self.quit = true,
            _ if self.panes.scroll(key) => {}
            Some(action) => self.act(action),
            None => {}
        }
        Ok(())
    }

    fn paste(&mut self, text: &str) {
        if self.prompt.is_open() {
            self.prompt.paste(text);
        }
    }

    fn rest(&mut self) {}

    fn go_on(&mut self) {}

    fn wants_quit(&self) -> bool {
        self.quit
    }
}
