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
use ratelab_replay::Overlap;
use ratelab_study::{
    experiment::{Config, Summary},
    system::System,
};

use operations::HeldKnot;

use super::{
    branch::{self, PreparedBranch},
    desk::Desk,
    executing::Executing,
    frame::TRACE_S,
    keys::{REPLAY, ReplayAction},
    model::Model,
    panes::Panes,
    presets::{self, Direction},
    sampler::{RunSource, Sampler, WatchedRows, watched},
    session::SessionSetup,
    view::{Bottom, ScreenState, Scrubber, StatusExtra},
};
use crate::{
    error::LabError,
    recording::{Executed, Recording, Replay},
    timing::earlier,
};

/// The step of PgUp and PgDn.
const SECOND: Duration = Duration::from_secs(1);

/// Run time between two samples of the push age.
const LOOK: Duration = Duration::from_millis(10);

/// Plays a recording: replays it into counters up to a moment, and shows them like those
/// of a run.
pub struct Player {
    desk: Desk<Playhead>,
    /// The settings of a branch, with its end and its speed.
    setup: SessionSetup,
    pace: (Time, Speed),
    /// The run while it is executed again.
    executing: Option<Executing>,
    /// The ticks that overlap, once it was executed again.
    knots: Vec<Overlap>,
    begins: Time,
    speed: f64,
    /// The branch to go on with.
    branch: Option<PreparedBranch>,
}

/// A position in a recording.
pub struct Playhead {
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
            desk: Desk {
                notice,
                ..Desk::new(Playhead::new(replay, Some(Instant::now())))
            },
            executing: None,
            knots: Vec::new(),
            begins,
            speed: 1.0,
            branch: None,
        };
        player.go(begins);
        player
    }

    /// Creates a player paused at run time `at`.
    pub fn still(recording: Arc<Recording>, system: &Arc<dyn System>, at: Time) -> Self {
        let mut player = Self::new(recording, system);
        player.desk.run.playing = None;
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
    pub fn within(mut self, setup: SessionSetup, pace: (Time, Speed), panes: Panes) -> Self {
        self.desk.panes = Panes {
            overlay: None,
            ..panes
        };
        self.desk
            .notify("the run itself: , and . step, B branches, q returns to the lab");
        Self {
            setup,
            pace,
            ..self
        }
    }

    fn ends(&self) -> Time {
        self.desk.run.replay.recording().until.max(self.begins)
    }

    /// Shows the moment `at`, limited to the range of the recording.
    pub fn go(&mut self, at: Time) {
        let at = at.clamp(self.begins, self.ends());
        if at < self.desk.run.at {
            self.rewind();
        }
        // What is sampled is there for the whole chart, from wherever one comes.
        let first = earlier(at, Duration::from_secs_f64(TRACE_S));
        let mut now = self.desk.run.at.max(first);
        while now < at {
            self.desk.run.advance_to(now);
            self.desk.sampler.look(&self.desk.run);
            now = now + LOOK;
        }
        self.desk.run.advance_to(at);
    }

    fn rewind(&mut self) {
        self.desk.run.rewind();
        self.desk.sampler = Sampler::default();
    }

    /// Advances by the wall time since the last call.
    fn play(&mut self) {
        let Some(since) = self.desk.run.playing else {
            return;
        };
        let now = Instant::now();
        self.go(self.desk.run.at + (now - since).mul_f64(self.speed));
        self.desk.run.playing = Some(now).filter(|_| self.desk.run.at < self.ends());
    }

    fn act(&mut self, action: ReplayAction) {
        match action {
            ReplayAction::Operation(direction) => return self.operate(direction),
            ReplayAction::Panes(_) | ReplayAction::Speed(_) => {}
            ReplayAction::SpeedOne | ReplayAction::Quit => {}
            _ => self.leave_knot(),
        }
        match action {
            ReplayAction::Play if self.desk.run.playing.is_some() => self.desk.run.playing = None,
            ReplayAction::Play => self.start(),
            ReplayAction::Step(direction) => self.step(direction),
            ReplayAction::Operation(_) => {}
            ReplayAction::Branch => {
                self.desk.run.playing = None;
                self.desk.prompt.open(Some(self.desk.run.at));
            }
            ReplayAction::Second(Direction::Up) => self.jump(self.desk.run.at + SECOND),
            ReplayAction::Second(Direction::Down) => self.jump(earlier(self.desk.run.at, SECOND)),
            ReplayAction::Event(direction) => self.event(direction),
            ReplayAction::Start => self.jump(self.begins),
            ReplayAction::End => self.jump(Time::MAX),
            ReplayAction::Speed(direction) => {
                match presets::next(&presets::SPEEDS, self.speed, direction) {
                    Some(speed) => self.speed = speed,
                    None => self
                        .desk
                        .notify(format!("{}× is the end of the speeds", self.speed)),
                }
            }
            ReplayAction::SpeedOne => self.speed = 1.0,
            ReplayAction::Panes(action) => self.act_on_panes(action, self.desk.run.at),
            ReplayAction::Quit => self.desk.quit = true,
        }
    }

    /// Starts playback, from the beginning if it is at the end.
    fn start(&mut self) {
        if self.desk.run.at == self.ends() {
            self.go(self.begins);
        }
        self.desk.run.playing = Some(Instant::now());
    }

    /// Jumps to `at`; playback goes on from there.
    fn jump(&mut self, at: Time) {
        self.go(at);
        self.go_on();
    }

    /// Steps to the moment of the neighbouring messages.
    fn step(&mut self, direction: Direction) {
        self.desk.run.playing = None;
        let replay = &self.desk.run.replay;
        let (to, end) = match direction {
            Direction::Up => (replay.next(), Time::MAX),
            Direction::Down => (replay.previous(), self.begins),
        };
        self.go(to.unwrap_or(end));
        self.desk.notice = self.desk.run.replay.happened();
    }

    fn event(&mut self, direction: Direction) {
        let mut events = self.events().iter().map(|event| event.at);
        let to = match direction {
            Direction::Up => events.find(|at| *at > self.desk.run.at),
            Direction::Down => events.rfind(|at| *at < self.desk.run.at),
        };
        match (to, direction) {
            (Some(at), _) => self.jump(at),
            (None, Direction::Up) => self.desk.notify("no event comes after this"),
            (None, Direction::Down) => self.desk.notify("no event came before this"),
        }
    }

    fn events(&self) -> &[Event] {
        &self.desk.run.replay.recording().events
    }

    fn scrubber(&self) -> Scrubber {
        Scrubber {
            begins: self.begins,
            at: self.desk.run.at,
            ends: self.ends(),
            events: self.events().iter().map(|event| event.at).collect(),
            playing: self.desk.run.playing.is_some(),
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
        let sampler = self.desk.sampler.next(&self.desk.run);
        Ok(Some((branch, sampler)))
    }
}

impl Model for Player {
    type Run = Playhead;

    fn desk(&self) -> &Desk<Playhead> {
        &self.desk
    }

    fn desk_mut(&mut self) -> &mut Desk<Playhead> {
        &mut self.desk
    }

    fn enter(&mut self, text: &str) -> Result<(), String> {
        let recording = self.desk.run.replay.shared_recording();
        let place = (self.desk.run.at, text);
        let branch = branch::prepare(&recording, &self.setup, place, self.pace)?;
        self.branch = Some(branch);
        self.desk.quit = true;
        Ok(())
    }

    fn sample(&mut self) -> Result<bool, LabError> {
        self.play();
        let moved = self.follow_execution() | self.follow_held();
        let new = self.desk.take_frame();
        Ok(new || moved || self.desk.run.playing.is_some())
    }

    fn screen(&self) -> Option<ScreenState<'_>> {
        let now = self.desk.run.at;
        let events = self.events().iter().filter(|event| event.at <= now);
        let screen = self.desk.screen(now, events.cloned().collect())?;
        let rows = || REPLAY.rows(|_| true);
        Some(ScreenState {
            knot: self.knot(),
            extra: StatusExtra {
                replay: true,
                ..screen.extra
            },
            scrubber: Some(self.scrubber()),
            page: self.desk.panes.page(rows, screen.system, screen.frame),
            bottom: Bottom {
                hints: REPLAY.hints(|_| true),
                ..screen.bottom
            },
            ..screen
        })
    }

    fn key(&mut self, key: &KeyEvent) -> Result<(), LabError> {
        self.desk.notice = None;
        let action = REPLAY.action(key);
        if !self.is_typed(key, action == Some(ReplayAction::Quit))
            && let Some(action) = action
        {
            self.act(action);
        }
        Ok(())
    }

    /// Continues from the same moment after the program was suspended.
    fn go_on(&mut self) {
        self.desk.run.playing = self.desk.run.playing.map(|_| Instant::now());
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
                .along(replay.system().about().latency_path),
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

    fn lineage(&self) -> &Lineage {
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
