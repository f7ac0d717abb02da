//! The state of the dashboard, and what the keys do to it.

mod brains;
mod cliff;
mod exercises;
mod knobs;
mod marks;
#[cfg(test)]
mod probe;
mod recording;
mod restart;
mod time;

use std::{collections::VecDeque, sync::Arc, time::Duration};

use crossterm::event::{KeyEvent, KeyModifiers};
use ratelab::{
    experiment::{Config, Knob},
    policy::Brain,
    runtime::{Command, Time, telemetry::Event},
};

use restart::Next;

use super::{
    Model,
    cliff::CliffMap,
    desk::Desk,
    error::LabError,
    focus::Pane,
    history::History,
    keys::{Action, LAB, MAP},
    ladder::Way,
    picture::{Picture, Trace},
    sampler::{Sampler, Watched},
    session::{Ended, Session, Setup},
    view::{Footer, Shown, StatusExtra},
};
use crate::recording::{Destination, RecordError, Recorded, Recorder};

pub use marks::{TRACE_S, marks};

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
    brains: Vec<Brain>,
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
    history: History,
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
    picture: Option<Arc<Picture>>,
    /// The exercises, while they are open.
    desk: Option<Desk>,
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
            brains: brains::available(session.config()),
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
            history: History::default(),
            destination: Destination::default(),
            record: false,
            completing: Vec::new(),
            recorded: Vec::new(),
            unrecorded: None,
            picture: None,
            desk: None,
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

    /// Which picture of how many is looked at; `None` live.
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
    pub fn finish(mut self) -> Left {
        let ended = match self.next {
            None => self.session.finish(),
            Some(_) => Err(self.session.abandon()),
        };
        self.finish_recordings();
        Left {
            ended,
            recorded: self.recorded,
            unrecorded: self.unrecorded,
        }
    }
}

/// What is left of the lab when a person leaves it.
#[derive(Debug)]
pub struct Left {
    /// What the last session came to.
    pub ended: Result<Ended, LabError>,
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
        let told = self.desk.as_mut().is_some_and(Desk::poll);
        let new = told | self.history.add(self.sampler.picture(&mut self.session));
        self.picture = self.history.shown();
        let mapped = self.follow_map();
        Ok(new || mapped)
    }

    fn shown(&self) -> Option<Shown<'_>> {
        let picture = self.picture.as_deref()?;
        Some(Shown {
            picture,
            trace: self.trace(picture.now),
            events: self.events(picture.now).cloned().collect(),
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
            page: self.desk.as_ref().map(Desk::page),
            notice: self.notice.as_deref(),
        })
    }

    fn key(&mut self, key: &KeyEvent) -> Result<(), LabError> {
        let action = LAB.action(key);
        if self.next.is_some() {
            // What is on its way to its end obeys nothing else.
            self.quit |= action == Some(Action::Quit);
            return Ok(());
        }
        self.notice = None;
        if self.prompt.is_some() && !is_chord(key) {
            self.edit(key);
            return Ok(());
        }
        if self.help && action != Some(Action::Quit) {
            self.help = false; // Any key closes it.
            return Ok(());
        }
        if self.desk.is_some() && !is_chord(key) {
            return self.at_desk(key);
        }
        let on_map = MAP.action(key).filter(|_| self.mapping);
        let done = match (on_map, action) {
            (Some(action), _) => self.act_on_map(action),
            (None, Some(action)) => self.act(action),
            (None, None) => Ok(()),
        };
        self.picture = self.history.shown();
        done
    }

    fn paste(&mut self, text: &str) {
        // A pasted line break is no Enter.
        let text = text.replace(char::is_control, " ");
        if let Some(prompt) = &mut self.prompt {
            prompt.push_str(&text);
        } else if let Some(desk) = &mut self.desk {
            desk.paste(&text);
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

    fn left(&self) -> bool {
        self.quit
    }
}

impl App {
    fn act(&mut self, action: Action) -> Result<(), LabError> {
        match action {
            Action::ControlRate(way) => self.turn_control_rate(way),
            Action::SensorRate(way) => self.turn_sensor_rate(way),
            Action::Depth(way) => self.turn_depth(way),
            Action::Break => self.break_it(),
            Action::Type => self.prompt = Some(String::new()),
            Action::Pause => self.pause(),
            Action::StepForward => self.step(),
            Action::StepBack => self.look_back(),
            Action::Oldest => self.history.oldest(),
            Action::Newest | Action::Live => self.history.live(),
            Action::Speed(way) => self.change_speed(way),
            Action::SpeedOne => self.set_speed(1.0),
            Action::OtherClock => self.other_clock(),
            Action::Map => self.open_map(),
            Action::Record => self.toggle_recording(),
            Action::Exercises => self.open_exercises(),
            Action::Restart => return self.restart(self.config.clone()),
            Action::Seed(way) => return self.change_seed(way),
            Action::Policy(way) => self.change_policy(way),
            Action::NextPane => self.focus = self.focus.next(),
            Action::Focus(pane) => self.focus = pane,
            Action::Zoom => self.zoomed = !self.zoomed,
            Action::Help => self.help = true,
            Action::Quit => return self.leave(),
        }
        Ok(())
    }

    /// The keys and what they do, those of the map first if it is open.
    fn keys(&self) -> Vec<(String, String)> {
        let map = if self.mapping { MAP.rows() } else { Vec::new() };
        map.into_iter().chain(LAB.rows()).collect()
    }

    fn say(&mut self, notice: impl Into<String>) {
        self.notice = Some(notice.into());
    }

    /// Whether the graph can still be changed; says so if not.
    fn alive(&mut self) -> bool {
        if self.ended() {
            self.say("the run is over: r starts again");
        }
        !self.ended()
    }

    fn change_seed(&mut self, way: Way) -> Result<(), LabError> {
        let seed = self.config.seed;
        let next = if way == Way::Up {
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
                self.at_end("seed", way, seed);
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
