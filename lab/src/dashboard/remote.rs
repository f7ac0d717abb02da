//! The dashboard over a run of other processes: it shows, turns knobs by asking, and leaves
//! without ending the run.

use crossterm::event::KeyEvent;
use ratelab::{
    runtime::{Depth, Hz, Knob, Snapshot, telemetry::Event},
    system::KnobText,
};

use super::{
    error::LabError,
    explain,
    focus::Pane,
    frame::{FrameData, SignalTrace},
    keys::{REMOTE, RemoteAction},
    knob_focus::KnobFocus,
    marks::{TRACE_S, marks},
    model::Model,
    overlay::{self, Overlay},
    presets::{self, Direction},
    prompt::{Prompt, Typed, Vocabulary},
    sampler::{self, RunSource, Sampler},
    timeline::TimelineView,
    view::{Footer, HelpPage, ScreenState, StatusExtra, TextPage},
};

/// A run of other processes.
pub trait Remote: RunSource {
    /// Takes what has come; returns whether another run began.
    fn update(&mut self) -> bool;

    /// Asks for a knob to be turned.
    fn turn(&mut self, knob: Knob);

    /// The last refusal of a knob since the last call.
    fn refusal(&mut self) -> Option<String>;

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
    typing: bool,
    focus: Pane,
    zoomed: bool,
    timeline: TimelineView,
    overlay: Option<Overlay>,
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
            typing: false,
            focus: Pane::Graph,
            zoomed: false,
            timeline: TimelineView::default(),
            overlay: None,
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
        self.timeline = TimelineView::default();
        self.knob_focus = KnobFocus::new(self.run.system(), &self.graph());
    }

    fn graph(&self) -> Snapshot {
        self.run.observer().read_counters()
    }

    fn act(&mut self, action: RemoteAction) {
        match action {
            RemoteAction::Rate(direction) => self.turn_rate(direction),
            RemoteAction::Depth(direction) => self.turn_depth(direction),
            RemoteAction::Type => {
                self.prompt.open();
                self.typing = true;
            }
            RemoteAction::NextPane => self.focus = self.focus.next(|pane| self.has(pane)),
            RemoteAction::Focus(pane) if self.has(pane) => self.focus = pane,
            RemoteAction::Focus(_) => self.notify("this system has nothing to show there"),
            RemoteAction::Push(later) => {
                let now = self.run.observer().now();
                sampler::select(&self.run, &mut self.timeline, now, later);
            }
            RemoteAction::Span(closer) => self.timeline.zoom(closer),
            RemoteAction::Zoom => self.zoomed = !self.zoomed,
            RemoteAction::Help => self.overlay = Some(Overlay::Help { scroll: 0 }),
            RemoteAction::Explain => self.overlay = Some(Overlay::Explained { scroll: 0 }),
            RemoteAction::Quit => self.quit = true,
        }
    }

    fn turn_rate(&mut self, direction: Direction) {
        let (graph, name) = (self.graph(), self.knob_focus.node.clone());
        let Some(hz) = graph.node(&name).map(|node| node.hz.get()) else {
            return;
        };
        let next = presets::next(&presets::RATES, hz, direction);
        match next.and_then(|hz| Hz::new(hz).ok()) {
            Some(hz) => self.run.turn(Knob::Rate { node: name, hz }),
            None => self.notify(format!("{hz} Hz is the end of the rates")),
        }
    }

    fn turn_depth(&mut self, direction: Direction) {
        let (graph, topics) = (self.graph(), self.knob_focus.topics.clone());
        let first = topics.first().and_then(|name| graph.topic(name));
        let Some(depth) = first.map(|topic| topic.depth as f64) else {
            return;
        };
        let next = presets::next(&presets::DEPTHS, depth, direction);
        let Some(depth) = next.and_then(|next| Depth::new(next as usize).ok()) else {
            return self.notify(format!("{depth} is the end of the depths"));
        };
        for topic in topics {
            self.run.turn(Knob::Depth { topic, depth });
        }
    }

    /// Adds a key to the prompt; Enter turns the typed knob.
    fn type_key(&mut self, key: &KeyEvent) {
        let mut prompt = std::mem::take(&mut self.prompt);
        let typed = self.with_vocabulary(|words| prompt.key(key, words));
        self.prompt = prompt;
        match typed {
            Typed::On => {}
            Typed::Cancelled => self.typing = false,
            Typed::Entered(text) => match KnobText(self.run.system().aliases()).parse(&text) {
                Ok(knobs) => {
                    knobs.into_iter().for_each(|knob| self.run.turn(knob));
                    self.typing = false;
                }
                Err(why) => self.prompt.refuse(why.to_string()),
            },
        }
    }

    fn with_vocabulary<T>(&self, look: impl FnOnce(&Vocabulary<'_>) -> T) -> T {
        look(&Vocabulary {
            system: self.run.system(),
            graph: &self.graph(),
            choices: &[],
        })
    }

    fn notify(&mut self, notice: impl Into<String>) {
        self.notice = Some(notice.into());
    }

    fn has(&self, pane: Pane) -> bool {
        self.screen().is_some_and(|screen| screen.has(pane))
    }

    fn trace(&self) -> Option<SignalTrace> {
        let (system, now) = (self.run.system(), self.run.observer().now());
        let trace = self.sampler.trace(system, now, TRACE_S)?;
        Some(SignalTrace {
            marks: marks(system, self.events.iter(), now),
            ..trace
        })
    }

    fn footer(&self) -> Footer<'_> {
        if self.typing {
            return Footer::Prompt {
                typed: self.prompt.typed(),
                refusal: self.prompt.refusal(),
                hint: self.with_vocabulary(|words| words.hint()),
            };
        }
        let hints = overlay::HINTS.iter();
        Footer::Hints(match self.overlay {
            None => REMOTE.hints(|_| true),
            Some(_) => hints.map(|(key, what)| (key.to_string(), *what)).collect(),
        })
    }

    fn help(&self) -> Option<HelpPage> {
        let scroll = self.overlay?.help()?;
        let rows = REMOTE.rows(|_| true);
        Some(HelpPage { rows, scroll })
    }

    fn page(&self) -> Option<TextPage> {
        let scroll = self.overlay?.explained()?;
        let signal = sampler::signal(self.run.system()).map(|signal| signal.name);
        let frame = self.frame.as_ref()?;
        Some(explain::page(self.focus, signal, frame, scroll))
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
        Some(ScreenState {
            system: self.run.system(),
            frame: self.frame.as_ref()?,
            trace: self.trace(),
            timeline: sampler::timeline(&self.run, self.timeline, now),
            knob_focus: self.knob_focus.clone(),
            events: self.events.clone(),
            extra: StatusExtra {
                clocks: self.run.clocks(),
                trouble: self.run.trouble(),
                ..StatusExtra::default()
            },
            focus: self.focus,
            zoomed: self.zoomed,
            scrubber: None,
            map: None,
            footer: self.footer(),
            help: self.help(),
            page: self.page(),
            aside: None,
            notice: self.notice.as_deref(),
        })
    }

    fn key(&mut self, key: &KeyEvent) -> Result<(), LabError> {
        self.notice = None;
        let action = REMOTE.action(key);
        let chord = action == Some(RemoteAction::Quit)
            && key.modifiers != crossterm::event::KeyModifiers::NONE;
        if self.typing && !chord {
            self.type_key(key);
            return Ok(());
        }
        let open = self.overlay.filter(|_| action != Some(RemoteAction::Quit));
        if let Some(overlay) = open {
            self.overlay = overlay.after(key);
        } else if let Some(action) = action {
            self.act(action);
        }
        Ok(())
    }

    fn paste(&mut self, text: &str) {
        if self.typing {
            self.prompt.paste(&text.replace(char::is_control, " "));
        }
    }

    fn rest(&mut self) {}

    fn go_on(&mut self) {}

    fn wants_quit(&self) -> bool {
        self.quit
    }
}
