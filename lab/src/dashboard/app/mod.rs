//! The state of the dashboard, and what the keys do to it.

mod cliff;
mod exercises;
mod knobs;
mod policies;
#[cfg(test)]
mod probe;
mod recording;
mod restart;
mod time;

use std::{collections::VecDeque, sync::Arc, time::Duration};

use crossterm::event::{KeyEvent, KeyModifiers};
use ratelab::{
    experiment::{Config, Knob},
    policy::PolicySpec,
    runtime::{Command, Time, telemetry::Event},
};

use restart::Next;

use super::{
    cliff::CliffMap,
    error::LabError,
    exercise_panel::ExercisePanel,
    focus::Pane,
    frame::{FrameData, Trace},
    history::FrameHistory,
    keys::{LAB, LabAction, MAP},
    marks::{TRACE_S, marks},
    model::Model,
    presets::Direction,
    sampler::{RunSource, Sampler},
    session::{Session, SessionResult, Setup},
    view::{Footer, ScreenState, StatusExtra},
};
use crate::recording::{Destination, RecordError, Recorded, Recorder};

/// The dashboard: one session at a time, what was seen of it, and where the
/// person looks.
pub struct App {
    /// The settings that the person wants, which are those of the next session.
    config: Config,
    /// The settings that the graph runs with, as far as its events tell.
    running: Config,
    /// Knobs that keys turned and the graph has not answered yet, oldest first.
    pressed: VecDeque<Knob>,
    /// What p and P go through.
    policies: Vec<PolicySpec>,
    /// Whether the person wants run time to stand still; the clock may not have
    /// heard of it yet.
    pause: bool,
    /// What happened to the session so far.
    events: Vec<Event>,
    setup: Setup,
    session: Session,
    /// What comes when the session has ended, if it is to end.
    next: Option<Next>,
    /// Whether run time stands still because the program is to be stopped.
    resting: bool,
    sampler: Sampler,
    history: FrameHistory,
    /// Where the next recording goes.
    destination: Destination,
    /// Whether the person wants sessions recorded.
    record: bool,
    /// Recordings that were told to end, and have to write a little yet.
    completing: Vec<Recorder>,
    /// Recordings that are complete.
    recorded: Vec<Recorded>,
    /// The first that ended early.
    unrecorded: Option<RecordError>,
    frame: Option<Arc<FrameData>>,
    /// The exercises, while they are open.
    panel: Option<ExercisePanel>,
    /// Whether the session is a rescue by hand, to be judged.
    by_hand: bool,
    /// The cliff map, once it was opened.
    map: Option<CliffMap>,
    /// Whether it is open.
    mapping: bool,
    /// The pane that keys of focus and zoom mean.
    pub focus: Pane,
    /// Whether the focused pane has the whole screen.
    pub zoomed: bool,
    /// Whether the keys are shown.
    pub help: bool,
    /// What is being typed, if something is.
    pub prompt: Option<String>,
    /// The last thing that the dashboard itself had to say.
    pub notice: Option<String>,
    /// Whether to leave.
    pub quit: bool,
}

impl App {
    /// Starts the first session.
    ///
    /// # Errors
    /// [`LabError`] if it cannot be started.
    pub fn new(config: &Config, setup: Setup) -> Result<Self, LabError> {
        let mut destination = setup.record.clone().unwrap_or_default();
        let record = setup.record.as_ref().map(|_| &mut destination);
        let session = Session::start(config, &setup, record)?;
        Ok(Self {
            destination,
            record: setup.record.is_some(),
            ..Self::watching(session, setup)
        })
    }

    /// Watches a session that has started already.
    pub fn watching(session: Session, setup: Setup) -> Self {
        Self {
            policies: policies::available(session.config()),
            config: without_knobs(session.config().clone()),
            running: without_knobs(session.config().clone()),
            pressed: VecDeque::new(),
            pause: false,
            events: Vec::new(),
            session,
            next: None,
            resting: false,
            setup,
            sampler: Sampler::default(),
            history: FrameHistory::default(),
            destination: Destination::default(),
            record: false,
            completing: Vec::new(),
            recorded: Vec::new(),
            unrecorded: None,
            frame: None,
            panel: None,
            by_hand: false,
            map: None,
            mapping: false,
            focus: Pane::Graph,
            zoomed: false,
            help: false,
            prompt: None,
            notice: None,
            quit: false,
        }
    }

    /// Which frame of how many is looked at; `None` live.
    pub fn looking_back(&self) -> Option<(usize, usize)> {
        self.history.position()
    }

    /// Whether the run is over.
    pub fn ended(&self) -> bool {
        self.session.summary().is_some()
    }

    /// Events until `now`.
    pub fn events(&self, now: Time) -> impl Iterator<Item = &Event> {
        self.events.iter().filter(move |event| event.at <= now)
    }

    /// The pole's angle until `now`, with marks where knobs were turned.
    pub fn trace(&self, now: Time) -> Trace {
        let mut trace = self.sampler.trace(now, TRACE_S);
        trace.marks = marks(self.events(now), now);
        trace
    }

    /// Ends the session in order: what it came to, and what became of recordings.
    /// One that was to end and did not is not waited for any longer.
    pub fn finish(mut self) -> LabOutcome {
        let ended = match self.next {
            None => self.session.finish(),
            Some(_) => Err(self.session.abandon()),
        };
        self.finish_recordings();
        LabOutcome {
            ended,
            recorded: self.recorded,
            unrecorded: self.unrecorded,
        }
    }
}

/// What is left of the lab when a person leaves it.
#[derive(Debug)]
pub struct LabOutcome {
    /// What the last session came to.
    pub ended: Result<SessionResult, LabError>,
    /// Recordings that are complete.
    pub recorded: Vec<Recorded>,
    /// The first that ended early.
    pub unrecorded: Option<RecordError>,
}

impl Model for App {
    fn sample(&mut self) -> Result<bool, LabError> {
        self.session.poll()?;
        self.follow_end(Duration::ZERO)?;
        self.follow_events();
        self.follow_recordings();
        let measured = self.panel.as_mut().is_some_and(ExercisePanel::poll);
        let new = measured | self.history.add(self.sampler.frame_data(&mut self.session));
        self.frame = self.history.shown();
        let mapped = self.follow_map();
        Ok(new || mapped)
    }

    fn screen(&self) -> Option<ScreenState<'_>> {
        let frame = self.frame.as_deref()?;
        Some(ScreenState {
            frame,
            trace: self.trace(frame.now),
            events: self.events(frame.now).cloned().collect(),
            extra: StatusExtra {
                back: self.looking_back(),
                ended: self.ended(),
                recording: self.recording(),
                replay: false,
            },
            focus: self.focus,
            zoomed: self.zoomed,
            scrubber: None,
            map: self.open(),
            footer: match &self.prompt {
                Some(typed) => Footer::Prompt(typed),
                None if self.mapping => Footer::Hints(MAP.hints()),
                None => Footer::Hints(LAB.hints()),
            },
            help: self.help.then(|| self.keys()),
            page: self.panel.as_ref().map(ExercisePanel::page),
            notice: self.notice.as_deref(),
        })
    }

    fn key(&mut self, key: &KeyEvent) -> Result<(), LabError> {
        let action = LAB.action(key);
        if self.next.is_some() {
            // What is on its way to its end obeys nothing else.
            self.quit |= action == Some(LabAction::Quit);
            return Ok(());
        }
        self.notice = None;
        if self.prompt.is_some() && !is_chord(key) {
            self.edit(key);
            return Ok(());
        }
        if self.help && action != Some(LabAction::Quit) {
            self.help = false; // Any key closes it.
            return Ok(());
        }
        if self.panel.is_some() && !is_chord(key) {
            return self.panel_key(key);
        }
        let on_map = MAP.action(key).filter(|_| self.mapping);
        let done = match (on_map, action) {
            (Some(action), _) => self.act_on_map(action),
            (None, Some(action)) => self.act(action),
            (None, None) => Ok(()),
        };
        self.frame = self.history.shown();
        done
    }

    fn paste(&mut self, text: &str) {
        // A pasted line break is no Enter.
        let text = text.replace(char::is_control, " ");
        if let Some(prompt) = &mut self.prompt {
            prompt.push_str(&text);
        } else if let Some(panel) = &mut self.panel {
            panel.paste(&text);
        }
    }

    fn rest(&mut self) {
        self.stand_still();
    }

    fn go_on(&mut self) {
        if std::mem::take(&mut self.resting) {
            self.session.send(Command::Resume);
        }
    }

    fn wants_quit(&self) -> bool {
        self.quit
    }
}

impl App {
    fn act(&mut self, action: LabAction) -> Result<(), LabError> {
        match action {
            LabAction::ControlRate(direction) => self.turn_control_rate(direction),
            LabAction::SensorRate(direction) => self.turn_sensor_rate(direction),
            LabAction::Depth(direction) => self.turn_depth(direction),
            LabAction::Break => self.break_it(),
            LabAction::Type => self.prompt = Some(String::new()),
            LabAction::Pause => self.pause(),
            LabAction::StepForward => self.step(),
            LabAction::StepBack => self.look_back(),
            LabAction::Oldest => self.history.oldest(),
            LabAction::Newest | LabAction::Live => self.history.live(),
            LabAction::Speed(direction) => self.change_speed(direction),
            LabAction::SpeedOne => self.set_speed(1.0),
            LabAction::OtherClock => self.other_clock(),
            LabAction::Map => self.open_map(),
            LabAction::Record => self.toggle_recording(),
            LabAction::Exercises => self.open_exercises(),
            LabAction::Restart => return self.restart(self.config.clone()),
            LabAction::Seed(direction) => return self.change_seed(direction),
            LabAction::Policy(direction) => self.change_policy(direction),
            LabAction::NextPane => self.focus = self.focus.next(),
            LabAction::Focus(pane) => self.focus = pane,
            LabAction::Zoom => self.zoomed = !self.zoomed,
            LabAction::Help => self.help = true,
            LabAction::Quit => return self.leave(),
        }
        Ok(())
    }

    /// The keys and what they do, those of the map first if it is open.
    fn keys(&self) -> Vec<(String, String)> {
        let map = if self.mapping { MAP.rows() } else { Vec::new() };
        map.into_iter().chain(LAB.rows()).collect()
    }

    fn notify(&mut self, notice: impl Into<String>) {
        self.notice = Some(notice.into());
    }

    /// Whether the graph can still be changed; says so if not.
    fn alive(&mut self) -> bool {
        if self.ended() {
            self.notify("the run is over: r starts again");
        }
        !self.ended()
    }

    fn change_seed(&mut self, direction: Direction) -> Result<(), LabError> {
        let seed = self.config.seed;
        let next = if direction == Direction::Up {
            seed.checked_add(1)
        } else {
            seed.checked_sub(1)
        };
        match next {
            Some(seed) => self.restart(Config {
                seed,
                ..self.config.clone()
            }),
            None => {
                self.at_end("seed", direction, seed);
                Ok(())
            }
        }
    }
}

/// Whether a key is held with Ctrl or Alt: such a key types nothing.
fn is_chord(key: &KeyEvent) -> bool {
    !(key.modifiers - KeyModifiers::SHIFT).is_empty()
}

/// A session's own timed knobs are done once; they do not start again with it.
fn without_knobs(config: Config) -> Config {
    Config {
        knobs: Vec::new(),
        ..config
    }
}
