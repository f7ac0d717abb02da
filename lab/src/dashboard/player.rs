//! A recording in the dashboard.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use crossterm::event::KeyEvent;
use ratelab::{
    cartpole::ControlStep,
    experiment::{Config, Summary},
    runtime::{Message, Observer, Time, telemetry::Event},
};

use super::{
    LabError, Model,
    app::{TRACE_S, marks},
    focus::Pane,
    keys::{REPLAY, ReplayAction as Action},
    ladder::{self, Way},
    picture::{Picture, Trace},
    sampler::{Sampler, Watched},
    view::{Footer, Scrubber, Shown, StatusExtra},
};
use crate::recording::{Recording, Retold};

/// What PgUp and PgDn move by.
const SECOND: Duration = Duration::from_secs(1);

/// Plays a recording: tells it to the counters up to a moment, and has pictures
/// made of them as of any run.
pub struct Player {
    tape: Tape,
    sampler: Sampler,
    picture: Option<Picture>,
    begins: Time,
    /// The moment that is shown.
    at: Time,
    /// When it was reached, if it plays.
    playing: Option<Instant>,
    speed: f64,
    focus: Pane,
    zoomed: bool,
    help: bool,
    notice: Option<String>,
    quit: bool,
}

/// What is told so far.
struct Tape {
    retold: Retold,
    observer: Observer,
    /// Control steps that no picture shows yet.
    steps: Vec<Message<ControlStep>>,
    /// What the run came to, if it is told to its end.
    summary: Option<Summary>,
    at: Time,
    playing: bool,
}

impl Player {
    /// At the beginning, playing.
    pub fn new(recording: Arc<Recording>) -> Self {
        let notice = recording.defect();
        let retold = Retold::new(recording);
        let begins = retold.begins();
        let mut player = Self {
            tape: Tape {
                observer: retold.observer(),
                retold,
                steps: Vec::new(),
                summary: None,
                at: begins,
                playing: true,
            },
            sampler: Sampler::default(),
            picture: None,
            begins,
            at: begins,
            playing: Some(Instant::now()),
            speed: 1.0,
            focus: Pane::Graph,
            zoomed: false,
            help: false,
            notice,
            quit: false,
        };
        player.go(begins);
        player
    }

    fn ends(&self) -> Time {
        self.tape.retold.recording().until.max(self.begins)
    }

    /// Shows the moment `at`, or the end that is nearer.
    fn go(&mut self, at: Time) {
        let at = at.clamp(self.begins, self.ends());
        if at < self.at {
            self.tape.rewind();
            self.sampler = Sampler::default();
        }
        self.at = at;
        self.tape.tell(at);
    }

    /// Goes on as long as it took since the last time.
    fn play(&mut self) {
        let Some(since) = self.playing else {
            return;
        };
        let now = Instant::now();
        self.playing = Some(now);
        self.go(self.at + (now - since).mul_f64(self.speed));
        if self.at == self.ends() {
            self.stand();
        }
    }

    fn stand(&mut self) {
        self.playing = None;
        self.tape.playing = false;
    }

    fn act(&mut self, action: Action) {
        match action {
            Action::Play if self.playing.is_some() => self.stand(),
            Action::Play => self.start(),
            Action::Step(way) => self.step(way),
            Action::Second(Way::Up) => self.jump(self.at + SECOND),
            Action::Second(Way::Down) => {
                let back = self.at.since(Time::ZERO + SECOND);
                self.jump(Time::ZERO + back);
            }
            Action::Event(way) => self.event(way),
            Action::Start => self.jump(self.begins),
            Action::End => self.jump(Time::MAX),
            Action::Speed(way) => match ladder::next(&ladder::SPEEDS, self.speed, way) {
                Some(speed) => self.speed = speed,
                None => self.notice = Some(format!("{}× is the end of the speeds", self.speed)),
            },
            Action::SpeedOne => self.speed = 1.0,
            Action::NextPane => self.focus = self.focus.next(),
            Action::Focus(pane) => self.focus = pane,
            Action::Zoom => self.zoomed = !self.zoomed,
            Action::Help => self.help = true,
            Action::Quit => self.quit = true,
        }
    }

    /// Plays on, from the beginning if it stands at the end.
    fn start(&mut self) {
        if self.at == self.ends() {
            self.go(self.begins);
        }
        self.playing = Some(Instant::now());
        self.tape.playing = true;
    }

    /// Goes to `at`, and plays on from there if it plays.
    fn jump(&mut self, at: Time) {
        self.go(at);
        self.playing = self.playing.map(|_| Instant::now());
    }

    /// Goes to the moment of the messages next to this one.
    fn step(&mut self, way: Way) {
        self.stand();
        let to = match way {
            Way::Up => self.tape.retold.next(),
            Way::Down => self.tape.retold.previous(),
        };
        match to {
            Some(at) => self.go(at),
            None if way == Way::Up => self.go(Time::MAX),
            None => self.go(self.begins),
        }
    }

    fn event(&mut self, way: Way) {
        let mut events = self.events().iter().map(|event| event.at);
        let to = match way {
            Way::Up => events.find(|at| *at > self.at),
            Way::Down => events.rfind(|at| *at < self.at),
        };
        match to {
            Some(at) => self.jump(at),
            None if way == Way::Up => self.notice = Some("no event comes after this".to_owned()),
            None => self.notice = Some("no event came before this".to_owned()),
        }
    }

    fn events(&self) -> &[Event] {
        &self.tape.retold.recording().events
    }

    fn trace(&self) -> Trace {
        let mut trace = self.sampler.trace(self.at, TRACE_S);
        let events = self.events().iter().filter(|event| event.at <= self.at);
        trace.marks = marks(events, self.at);
        trace
    }

    fn scrubber(&self) -> Scrubber {
        Scrubber {
            begins: self.begins,
            at: self.at,
            ends: self.ends(),
            events: self.events().iter().map(|event| event.at).collect(),
            playing: self.playing.is_some(),
            speed: self.speed,
        }
    }
}

impl Model for Player {
    fn sample(&mut self) -> Result<bool, LabError> {
        self.play();
        let picture = Some(self.sampler.picture(&mut self.tape));
        let new = picture != self.picture;
        self.picture = picture;
        Ok(new || self.playing.is_some())
    }

    fn shown(&self) -> Option<Shown<'_>> {
        let events = self.events().iter().filter(|event| event.at <= self.at);
        Some(Shown {
            picture: self.picture.as_ref()?,
            trace: self.trace(),
            events: events.cloned().collect(),
            extra: StatusExtra {
                ended: self.tape.summary.is_some(),
                replay: true,
                ..StatusExtra::default()
            },
            focus: self.focus,
            zoomed: self.zoomed,
            scrubber: Some(self.scrubber()),
            map: None,
            footer: Footer::Hints(REPLAY.hints()),
            help: self.help.then(|| REPLAY.rows()),
            page: None,
            notice: self.notice.as_deref(),
        })
    }

    fn key(&mut self, key: &KeyEvent) -> Result<(), LabError> {
        self.notice = None;
        let action = REPLAY.action(key);
        if self.help && action != Some(Action::Quit) {
            self.help = false; // Any key closes it.
        } else if let Some(action) = action {
            self.act(action);
        }
        Ok(())
    }

    fn paste(&mut self, _: &str) {}

    fn rest(&mut self) {}

    /// It goes on from where it was, however long the program was stopped.
    fn go_on(&mut self) {
        self.playing = self.playing.map(|_| Instant::now());
    }

    fn left(&self) -> bool {
        self.quit
    }
}

impl Tape {
    fn rewind(&mut self) {
        self.retold.rewind();
        self.observer = self.retold.observer();
        self.steps.clear();
        self.summary = None;
    }

    fn tell(&mut self, until: Time) {
        self.at = until;
        self.steps.extend(self.retold.tell(until));
        if self.retold.is_over() && self.summary.is_none() {
            self.summary = Some(self.retold.summary());
        }
    }
}

impl Watched for Tape {
    fn config(&self) -> &Config {
        self.retold.config()
    }

    fn observer(&self) -> &Observer {
        &self.observer
    }

    /// Not recorded: a replay has the time of the run only.
    fn wall_time(&self) -> Duration {
        self.at.since(Time::ZERO)
    }

    fn new_steps(&mut self) -> Vec<Message<ControlStep>> {
        std::mem::take(&mut self.steps)
    }

    fn lost(&self) -> u64 {
        let outcome = self.retold.recording().outcome.as_ref();
        outcome.map_or(0, |outcome| outcome.lost)
    }

    fn summary(&self) -> Option<&Summary> {
        self.summary.as_ref()
    }

    fn at_rest(&self) -> bool {
        !self.playing
    }
}
