//! A recording in the dashboard.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use crossterm::event::KeyEvent;
use ratelab::{
    experiment::{Config, Summary},
    runtime::{
        Observer, Time,
        telemetry::{Event, Lineage},
    },
    system::System,
};

use super::{
    error::LabError,
    explain,
    focus::Pane,
    frame::{FrameData, Trace},
    keys::{REPLAY, ReplayAction},
    knob_focus::KnobFocus,
    marks::{TRACE_S, marks},
    model::Model,
    overlay::{self, Overlay},
    presets::{self, Direction},
    sampler::{self, RunSource, Sampler, WatchedRows, watched},
    view::{Footer, HelpPage, ScreenState, Scrubber, StatusExtra, TextPage},
};
use crate::recording::{Recording, Replay};

/// What PgUp and PgDn move by.
const SECOND: Duration = Duration::from_secs(1);

/// Plays a recording: replays it into the counters up to a moment, and shows
/// them as those of any run.
pub struct Player {
    playhead: Playhead,
    sampler: Sampler,
    frame: Option<FrameData>,
    begins: Time,
    /// The moment that is shown.
    at: Time,
    /// When it was reached, if it plays.
    playing: Option<Instant>,
    speed: f64,
    focus: Pane,
    zoomed: bool,
    /// What lies over the panes.
    overlay: Option<Overlay>,
    notice: Option<String>,
    quit: bool,
}

/// What is replayed so far.
struct Playhead {
    replay: Replay,
    observer: Observer,
    /// The chains behind all actions of the run.
    lineage: Lineage,
    /// What the run came to, if it is replayed to its end.
    summary: Option<Summary>,
    at: Time,
    playing: bool,
}

impl Player {
    /// At the beginning, playing.
    pub fn new(recording: Arc<Recording>, system: &Arc<dyn System>) -> Self {
        let notice = recording.defect();
        let replay = Replay::new(recording, system);
        let begins = replay.begins();
        let mut player = Self {
            playhead: Playhead {
                observer: replay.observer(),
                lineage: replay.recording().lineage(),
                replay,
                summary: None,
                at: begins,
                playing: true,
            },
            sampler: Sampler::default(),
            frame: None,
            begins,
            at: begins,
            playing: Some(Instant::now()),
            speed: 1.0,
            focus: Pane::Graph,
            zoomed: false,
            overlay: None,
            notice,
            quit: false,
        };
        player.go(begins);
        player
    }

    fn ends(&self) -> Time {
        self.playhead.replay.recording().until.max(self.begins)
    }

    /// Shows the moment `at`, or the end that is nearer.
    fn go(&mut self, at: Time) {
        let at = at.clamp(self.begins, self.ends());
        if at < self.at {
            self.playhead.rewind();
            self.sampler = Sampler::default();
        }
        self.at = at;
        self.playhead.advance_to(at);
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
        self.playhead.playing = false;
    }

    fn act(&mut self, action: ReplayAction) {
        match action {
            ReplayAction::Play if self.playing.is_some() => self.stand(),
            ReplayAction::Play => self.start(),
            ReplayAction::Step(direction) => self.step(direction),
            ReplayAction::Second(Direction::Up) => self.jump(self.at + SECOND),
            ReplayAction::Second(Direction::Down) => {
                let back = self.at.since(Time::ZERO + SECOND);
                self.jump(Time::ZERO + back);
            }
            ReplayAction::Event(direction) => self.event(direction),
            ReplayAction::Start => self.jump(self.begins),
            ReplayAction::End => self.jump(Time::MAX),
            ReplayAction::Speed(direction) => {
                match presets::next(&presets::SPEEDS, self.speed, direction) {
                    Some(speed) => self.speed = speed,
                    None => self.notice = Some(format!("{}× is the end of the speeds", self.speed)),
                }
            }
            ReplayAction::SpeedOne => self.speed = 1.0,
            ReplayAction::NextPane => self.focus = self.focus.next(|pane| self.has(pane)),
            ReplayAction::Focus(pane) if self.has(pane) => self.focus = pane,
            ReplayAction::Focus(_) => {
                self.notice = Some("this system has nothing to show there".to_owned());
            }
            ReplayAction::Zoom => self.zoomed = !self.zoomed,
            ReplayAction::Help => self.overlay = Some(Overlay::Help { scroll: 0 }),
            ReplayAction::Explain => self.overlay = Some(Overlay::Explained { scroll: 0 }),
            ReplayAction::Quit => self.quit = true,
        }
    }

    /// Plays on, from the beginning if it stands at the end.
    fn start(&mut self) {
        if self.at == self.ends() {
            self.go(self.begins);
        }
        self.playing = Some(Instant::now());
        self.playhead.playing = true;
    }

    /// Goes to `at`, and plays on from there if it plays.
    fn jump(&mut self, at: Time) {
        self.go(at);
        self.playing = self.playing.map(|_| Instant::now());
    }

    /// Goes to the moment of the messages next to this one.
    fn step(&mut self, direction: Direction) {
        self.stand();
        let to = match direction {
            Direction::Up => self.playhead.replay.next(),
            Direction::Down => self.playhead.replay.previous(),
        };
        match to {
            Some(at) => self.go(at),
            None if direction == Direction::Up => self.go(Time::MAX),
            None => self.go(self.begins),
        }
    }

    fn event(&mut self, direction: Direction) {
        let mut events = self.events().iter().map(|event| event.at);
        let to = match direction {
            Direction::Up => events.find(|at| *at > self.at),
            Direction::Down => events.rfind(|at| *at < self.at),
        };
        match to {
            Some(at) => self.jump(at),
            None if direction == Direction::Up => {
                self.notice = Some("no event comes after this".to_owned())
            }
            None => self.notice = Some("no event came before this".to_owned()),
        }
    }

    fn events(&self) -> &[Event] {
        &self.playhead.replay.recording().events
    }

    fn trace(&self) -> Option<Trace> {
        let system = self.playhead.system();
        let trace = self.sampler.trace(system, self.at, TRACE_S)?;
        let events = self.events().iter().filter(|event| event.at <= self.at);
        Some(Trace {
            marks: marks(system, events, self.at),
            ..trace
        })
    }

    fn hints(&self) -> Vec<(String, &'static str)> {
        match self.overlay {
            None => REPLAY.hints(|_| true),
            Some(_) => {
                let hints = overlay::HINTS.iter();
                hints.map(|(key, what)| (key.to_string(), *what)).collect()
            }
        }
    }

    fn help(&self) -> Option<HelpPage> {
        let scroll = self.overlay?.help()?;
        let rows = REPLAY.rows(|_| true);
        Some(HelpPage { rows, scroll })
    }

    fn page(&self) -> Option<TextPage> {
        let scroll = self.overlay?.explained()?;
        let signal = sampler::signal(self.playhead.system()).map(|signal| signal.name);
        Some(explain::page(
            self.focus,
            signal,
            self.frame.as_ref()?,
            scroll,
        ))
    }

    fn has(&self, pane: Pane) -> bool {
        self.screen().is_some_and(|screen| screen.has(pane))
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
        let frame = Some(self.sampler.frame_data(&mut self.playhead));
        let new = frame != self.frame;
        self.frame = frame;
        Ok(new || self.playing.is_some())
    }

    fn screen(&self) -> Option<ScreenState<'_>> {
        let events = self.events().iter().filter(|event| event.at <= self.at);
        Some(ScreenState {
            system: self.playhead.system(),
            frame: self.frame.as_ref()?,
            trace: self.trace(),
            knob_focus: KnobFocus::default(),
            events: events.cloned().collect(),
            extra: StatusExtra {
                ended: self.playhead.summary.is_some(),
                replay: true,
                ..StatusExtra::default()
            },
            focus: self.focus,
            zoomed: self.zoomed,
            scrubber: Some(self.scrubber()),
            map: None,
            footer: Footer::Hints(self.hints()),
            help: self.help(),
            page: self.page(),
            notice: self.notice.as_deref(),
        })
    }

    fn key(&mut self, key: &KeyEvent) -> Result<(), LabError> {
        self.notice = None;
        let action = REPLAY.action(key);
        let open = self.overlay.filter(|_| action != Some(ReplayAction::Quit));
        if let Some(overlay) = open {
            self.overlay = overlay.after(key);
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

    fn wants_quit(&self) -> bool {
        self.quit
    }
}

impl Playhead {
    fn rewind(&mut self) {
        self.replay.rewind();
        self.observer = self.replay.observer();
        self.summary = None;
    }

    fn advance_to(&mut self, until: Time) {
        self.at = until;
        self.replay.advance_to(until);
        if self.replay.is_over() && self.summary.is_none() {
            self.summary = Some(self.replay.summary());
        }
    }
}

impl RunSource for Playhead {
    fn shared_system(&self) -> &Arc<dyn System> {
        self.replay.system()
    }

    fn config(&self) -> &Config {
        self.replay.config()
    }

    fn observer(&self) -> &Observer {
        &self.observer
    }

    fn live(&self) -> bool {
        false
    }

    /// Not recorded: a replay has the time of the run only.
    fn wall_time(&self) -> Duration {
        self.at.since(Time::ZERO)
    }

    fn new_rows(&mut self) -> Vec<WatchedRows> {
        let topics: Vec<_> = watched(self.system()).collect();
        let rows = topics.into_iter();
        rows.map(|topic| (topic, self.replay.new_rows(topic)))
            .collect()
    }

    fn lineage(&mut self) -> &Lineage {
        &self.lineage
    }

    fn lost(&self) -> u64 {
        let outcome = self.replay.recording().outcome.as_ref();
        outcome.map_or(0, |outcome| outcome.lost)
    }

    fn summary(&self) -> Option<&Summary> {
        self.summary.as_ref()
    }

    fn at_rest(&self) -> bool {
        !self.playing
    }
}
