//! The dashboard over a run of other processes: it shows, turns knobs by asking, and leaves
//! without ending the run.

use crossterm::event::KeyEvent;
use ratelab::{Event, Knob};
use ratelab_study::system::{KnobText, Setup};

use super::{
    desk::Desk,
    keys::{LabAction, REMOTE},
    knob_focus::KnobFocus,
    model::Model,
    presets::RATES,
    sampler::{RunSource, Sampler},
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
    desk: Desk<R>,
    events: Vec<Event>,
}

impl<R: Remote> Watcher<R> {
    /// Shows `run` from now on.
    pub fn new(run: R) -> Self {
        let mut watcher = Self {
            desk: Desk::new(run),
            events: Vec::new(),
        };
        watcher.begin();
        watcher
    }

    /// Forgets the run before.
    fn begin(&mut self) {
        self.desk.sampler = Sampler::default();
        self.events.clear();
        self.desk.panes.timeline = TimelineView::default();
        self.desk.knob_focus = KnobFocus::new(self.desk.run.system(), &self.desk.graph());
    }

    fn act(&mut self, action: LabAction) {
        match action {
            LabAction::Rate(direction) => {
                let (node, none) = (&self.desk.knob_focus.node, Setup::default());
                self.turn(self.desk.next_rate(node, &none, &RATES, direction));
            }
            LabAction::Depth(direction) => {
                self.turn(self.desk.next_depth(&Setup::default(), direction));
            }
            LabAction::Type => self.desk.prompt.open(None),
            LabAction::Record => {
                let notice = self.desk.run.record();
                self.desk.notify(notice);
            }
            LabAction::Panes(action) => {
                self.act_on_panes(action, self.desk.run.observer().now());
            }
            LabAction::Quit => self.desk.quit = true,
            // No key of this screen.
            _ => {}
        }
    }

    /// Turns knobs, or prints the reason why this is impossible.
    fn turn(&mut self, knobs: Result<Vec<Knob>, String>) {
        match knobs {
            Ok(knobs) => knobs.into_iter().for_each(|knob| self.desk.run.turn(knob)),
            Err(reason) => self.desk.notify(reason),
        }
    }
}

impl<R: Remote> Model for Watcher<R> {
    type Run = R;

    fn desk(&self) -> &Desk<R> {
        &self.desk
    }

    fn desk_mut(&mut self) -> &mut Desk<R> {
        &mut self.desk
    }

    fn enter(&mut self, text: &str) -> Result<(), String> {
        let knobs = KnobText(self.desk.run.system().aliases()).parse(text);
        let knobs = knobs.map_err(|why| why.to_string())?;
        knobs.into_iter().for_each(|knob| self.desk.run.turn(knob));
        Ok(())
    }

    fn sample(&mut self) -> Result<bool, LabError> {
        if self.desk.run.update() {
            self.begin();
        }
        let refusal = self.desk.run.refusal();
        self.desk.notice = refusal.or(self.desk.notice.take());
        let events = self.desk.run.observer().events(self.events.len());
        self.events.extend(events);
        self.desk.take_frame();
        // The time that somebody is gone for goes on, too.
        Ok(true)
    }

    fn screen(&self) -> Option<ScreenState<'_>> {
        let run = &self.desk.run;
        let screen = self
            .desk
            .screen(run.observer().now(), self.events.clone())?;
        let rows = || REMOTE.rows(|_| true);
        Some(ScreenState {
            extra: StatusExtra {
                recording: run.recording(),
                clocks: run.clocks(),
                trouble: run.trouble(),
                ended: run.is_over(),
                ..screen.extra
            },
            page: self.desk.panes.page(rows, screen.system, screen.frame),
            bottom: Bottom {
                hints: REMOTE.hints(|_| true),
                ..screen.bottom
            },
            ..screen
        })
    }

    fn key(&mut self, key: &KeyEvent) -> Result<(), LabError> {
        self.desk.notice = None;
        let action = REMOTE.action(key);
        if !self.is_typed(key, action == Some(LabAction::Quit))
            && let Some(action) = action
        {
            self.act(action);
        }
        Ok(())
    }
}
