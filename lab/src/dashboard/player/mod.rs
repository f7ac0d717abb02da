//! A recording in the dashboard.

mod again;
mod operations;

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use crossterm::event::KeyEvent;
use ratelab::{Event, Speed, Time};
use ratelab_account::{Lineage, Observer};
use ratelab_replay::Knot;
use ratelab_study::{
    experiment::{Config, Summary},
    system::System,
};

use operations::HeldKnot;

use super::{
    branch::{self, PreparedBranch},
    executing::Executing,
    frame::{FrameData, SignalTrace},
    keys::{REPLAY, ReplayAction, is_chord},
    knob_focus::KnobFocus,
    marks::{TRACE_S, marks},
    model::Model,
    panes::Panes,
    presets::{self, Direction},
    prompt::{Prompt, TypesKnobs, Vocabulary},
    sampler::{self, RunSource, Sampler, WatchedRows, watched},
    session::SessionSetup,
    view::{Bottom, ScreenState, Scrubber, StatusExtra},
};
use crate::{
    error::LabError,
    recording::{Executed, Recording, Replay},
};

/// The step of PgUp and PgDn.
const SECOND: Duration = Duration::from_secs(1);

/// Run time between two samples of the push age.
const LOOK: Duration = Duration::from_millis(10);

/// Plays a recording: replays it into counters up to a moment, and shows them like those
/// of a run.
pub struct Player {
    playhead: Playhead,
    /// The settings of a branch, with its end and its speed.
    setup: SessionSetup,
    pace: (Time, Speed),
    sampler: Sampler,
    frame: Option<FrameData>,
    /// The run while it is executed again.
    executing: Option<Executing>,
    /// The ticks that overlap, once it was executed again.
    knots: Vec<Knot>,
    begins: Time,
    speed: f64,
    panes: Panes,
    /// The input line for the knob of a branch.
    prompt: Prompt,
    /// The branch to go on with.
    branch: Option<PreparedBranch>,
    notice: Option<String>,
    quit: bool,
}

/// A position in a recording.
struct Playhead {
    replay: Replay,
    /// The run itself, held within ticks that overlap.
    held: Option<HeldKnot>,
    observer: Observer,
    /// The chains behind all actions of the run.
    lineage: Lineage,
    /// The summary of the run, at its end.
    summary: Option<Summary>,
    at: Time,
    /// Wall time at which `at` was reached, during playback.
    playing: Option<Instant>,
}

impl Player {
    /// Creates a player at the beginning, playing.
    pub fn new(recording: Arc<Recording>, system: &Arc<dyn System>) -> Self {
        let notice = recording.defect();
        let replay = Replay::new(recording, system);
        let begins = replay.begins();
        let mut player = Self {
            setup: SessionSetup::new(replay.system().clone(), false),
            pace: (Time::MAX, Speed::REAL_TIME),
            playhead: Playhead::new(replay, Some(Instant::now())),
            sampler: Sampler::default(),
            frame: None,
            executing: None,
            knots: Vec::new(),
            begins,
            speed: 1.0,
            panes: Panes::default(),
            prompt: Prompt::default(),
            branch: None,
            notice,
            quit: false,
        };
        player.go(begins);
        player
    }

    /// Creates a player paused at run time `at`.
    pub fn still(recording: Arc<Recording>, system: &Arc<dyn System>, at: Time) -> Self {
        let mut player = Self::new(recording, system);
        player.playhead.playing = None;
        player.go(at);
        player
    }

    /// Creates a player paused at the end of a run that was executed again.
    pub fn at_the_end(executed: Executed, system: &Arc<dyn System>) -> Self {
        let Executed { recording, knots } = executed;
        let until = recording.until;
        Self {
            knots,
            ..Self::still(recording, system, until)
        }
    }

    /// The same within the lab: branches have its `setup` and `pace`, and the panes stay.
    pub fn within(self, setup: SessionSetup, pace: (Time, Speed), panes: Panes) -> Self {
        let panes = Panes {
            overlay: None,
            ..panes
        };
        let notice =
            Some("the run itself: , and . step, B branches, q returns to the lab".to_owned());
        Self {
            setup,
            pace,
            panes,
            notice,
            ..self
        }
    }

    fn ends(&self) -> Time {
        self.playhead.replay.recording().until.max(self.begins)
    }

    /// Shows the moment `at`, limited to the range of the recording.
    pub fn go(&mut self, at: Time) {
        let at = at.clamp(self.begins, self.ends());
        if at < self.playhead.at {
            self.rewind();
        }
        // What is sampled is there for the whole chart, from wherever one comes.
        let chart = Duration::from_secs_f64(TRACE_S);
        let first = Time::ZERO + at.since(Time::ZERO + chart);
        let mut now = self.playhead.at.max(first);
        while now < at {
            self.playhead.advance_to(now);
            self.sampler.look(&self.playhead);
            now = now + LOOK;
        }
        self.playhead.advance_to(at);
    }

    fn rewind(&mut self) {
        self.playhead.rewind();
        self.sampler = Sampler::default();
    }

    /// Advances by the wall time since the last call.
    fn play(&mut self) {
        let Some(since) = self.playhead.playing else {
            return;
        };
        let now = Instant::now();
        self.go(self.playhead.at + (now - since).mul_f64(self.speed));
        self.playhead.playing = Some(now).filter(|_| self.playhead.at < self.ends());
    }

    fn act(&mut self, action: ReplayAction) {
        match action {
            ReplayAction::Operation(direction) => return self.operate(direction),
            ReplayAction::Panes(_) | ReplayAction::Speed(_) => {}
            ReplayAction::SpeedOne | ReplayAction::Quit => {}
            _ => self.leave_knot(),
        }
        match action {
            ReplayAction::Play if self.playhead.playing.is_some() => self.playhead.playing = None,
            ReplayAction::Play => self.start(),
            ReplayAction::Step(direction) => self.step(direction),
            ReplayAction::Operation(_) => {}
            ReplayAction::Branch => {
                self.playhead.playing = None;
                self.prompt.open();
            }
            ReplayAction::Second(Direction::Up) => self.jump(self.playhead.at + SECOND),
            ReplayAction::Second(Direction::Down) => {
                let back = self.playhead.at.since(Time::ZERO + SECOND);
                self.jump(Time::ZERO + back);
            }
            ReplayAction::Event(direction) => self.event(direction),
            ReplayAction::Start => self.jump(self.begins),
            ReplayAction::End => self.jump(Time::MAX),
            ReplayAction::Speed(direction) => {
                match presets::next(&presets::SPEEDS, self.speed, direction) {
                    Some(speed) => self.speed = speed,
                    None => self.notify(format!("{}× is the end of the speeds", self.speed)),
                }
            }
            ReplayAction::SpeedOne => self.speed = 1.0,
            ReplayAction::Panes(action) => {
                let run = (&self.playhead, self.playhead.at);
                match self.panes.after(action, self.screen().as_ref(), run) {
                    Ok(panes) => self.panes = panes,
                    Err(notice) => self.notify(notice),
                }
            }
            ReplayAction::Quit => self.quit = true,
        }
    }

    /// Starts playback, from the beginning if it is at the end.
    fn start(&mut self) {
        if self.playhead.at == self.ends() {
            self.go(self.begins);
        }
        self.playhead.playing = Some(Instant::now());
    }

    /// Jumps to `at`; playback goes on from there.
    fn jump(&mut self, at: Time) {
        self.go(at);
        self.go_on();
    }

    /// Steps to the moment of the neighbouring messages.
    fn step(&mut self, direction: Direction) {
        self.playhead.playing = None;
        let replay = &self.playhead.replay;
        let (to, end) = match direction {
            Direction::Up => (replay.next(), Time::MAX),
            Direction::Down => (replay.previous(), self.begins),
        };
        self.go(to.unwrap_or(end));
        self.notice = self.playhead.replay.happened();
    }

    fn event(&mut self, direction: Direction) {
        let mut events = self.events().iter().map(|event| event.at);
        let to = match direction {
            Direction::Up => events.find(|at| *at > self.playhead.at),
            Direction::Down => events.rfind(|at| *at < self.playhead.at),
        };
        match (to, direction) {
            (Some(at), _) => self.jump(at),
            (None, Direction::Up) => self.notify("no event comes after this"),
            (None, Direction::Down) => self.notify("no event came before this"),
        }
    }

    fn notify(&mut self, notice: impl Into<String>) {
        self.notice = Some(notice.into());
    }

    fn events(&self) -> &[Event] {
        &self.playhead.replay.recording().events
    }

    fn trace(&self) -> Option<SignalTrace> {
        let system = self.playhead.system();
        let trace = self.sampler.trace(system, self.playhead.at, TRACE_S)?;
        let events = self
            .events()
            .iter()
            .filter(|event| event.at <= self.playhead.at);
        Some(SignalTrace {
            marks: marks(system, events, self.playhead.at),
            ..trace
        })
    }

    fn scrubber(&self) -> Scrubber {
        Scrubber {
            begins: self.begins,
            at: self.playhead.at,
            ends: self.ends(),
            events: self.events().iter().map(|event| event.at).collect(),
            playing: self.playhead.playing.is_some(),
            speed: self.speed,
        }
    }
}

impl Player {
    /// The branch to go on with, if there is one.
    pub fn take_branch(&mut self) -> Option<PreparedBranch> {
        self.branch.take()
    }

    /// The branch to go on with, if there is one, and a sampler that knows the whole run.
    ///
    /// # Errors
    /// [`LabError`] if the run cannot be read.
    pub fn into_branch(mut self) -> Result<Option<(PreparedBranch, Sampler)>, LabError> {
        let Some(branch) = self.take_branch() else {
            return Ok(None);
        };
        self.go(Time::MAX);
        self.sample()?;
        let sampler = self.sampler.next(&self.playhead);
        Ok(Some((branch, sampler)))
    }
}

impl TypesKnobs for Player {
    fn prompt(&mut self) -> &mut Prompt {
        &mut self.prompt
    }

    fn vocabulary(&self) -> Vocabulary<'_> {
        Vocabulary {
            system: self.playhead.system(),
            graph: self.playhead.observer.read_counters(),
            choices: &[],
        }
    }

    fn enter(&mut self, text: &str) -> Result<(), String> {
        let recording = self.playhead.replay.shared_recording();
        let place = (self.playhead.at, text);
        let branch = branch::prepare(&recording, &self.setup, place, self.pace)?;
        self.branch = Some(branch);
        self.quit = true;
        Ok(())
    }
}

impl Model for Player {
    fn sample(&mut self) -> Result<bool, LabError> {
        self.play();
        let moved = self.follow_execution() | self.follow_held();
        let rows = self.playhead.new_rows();
        let frame = Some(self.sampler.frame_data(&mut self.playhead, &rows));
        let new = frame != self.frame;
        self.frame = frame;
        Ok(new || moved || self.playhead.playing.is_some())
    }

    fn screen(&self) -> Option<ScreenState<'_>> {
        let events = self
            .events()
            .iter()
            .filter(|event| event.at <= self.playhead.at);
        let (system, frame) = (self.playhead.system(), self.frame.as_ref()?);
        Some(ScreenState {
            system,
            frame,
            trace: self.trace(),
            timeline: sampler::timeline(&self.playhead, self.panes.timeline, self.playhead.at),
            knot: self.knot(),
            knob_focus: KnobFocus::default(),
            events: events.cloned().collect(),
            extra: StatusExtra {
                ended: self.playhead.summary.is_some(),
                replay: true,
                ..StatusExtra::default()
            },
            focus: self.panes.focus,
            zoomed: self.panes.zoomed,
            scrubber: Some(self.scrubber()),
            map: None,
            page: self.panes.page(|| REPLAY.rows(|_| true), system, frame),
            aside: None,
            bottom: Bottom {
                hints: REPLAY.hints(|_| true),
                prompt: (self.prompt.is_open())
                    .then(|| self.prompt.line(&self.vocabulary(), Some(self.playhead.at))),
                notice: self.notice.as_deref(),
            },
        })
    }

    fn key(&mut self, key: &KeyEvent) -> Result<(), LabError> {
        self.notice = None;
        if self.prompt.is_open() && !is_chord(key) {
            self.type_key(key);
            return Ok(());
        }
        match REPLAY.action(key) {
            Some(ReplayAction::Quit) => self.quit = true,
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

    /// Continues from the same moment after the program was suspended.
    fn go_on(&mut self) {
        self.playhead.playing = self.playhead.playing.map(|_| Instant::now());
    }

    fn wants_quit(&self) -> bool {
        self.quit
    }
}

impl Playhead {
    /// The beginning of `replay`.
    fn new(replay: Replay, playing: Option<Instant>) -> Self {
        Self {
            observer: replay.observer(),
            lineage: replay
                .recording()
                .lineage()
                .along(replay.system().latency_path()),
            at: replay.begins(),
            replay,
            held: None,
            summary: None,
            playing,
        }
    }

    fn rewind(&mut self) {
        self.at = Time::ZERO;
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
        let there = self.held.as_ref().filter(|held| held.done.is_some());
        there.map_or(&self.observer, |held| held.run.observer())
    }

    fn live(&self) -> bool {
        false
    }

    /// Not recorded: a replay has run time only.
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

    fn known_lineage(&self) -> &Lineage {
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
        self.playing.is_none()
    }
}
