//! A recording that is played: replayed into counters up to a moment, and shown like a run.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use ratelab::Time;
use ratelab_experiment::{Config, Summary};
use ratelab_metrics::{Lineage, Observer};
use ratelab_re_execution::Overlap;
use ratelab_recording::{Execution, Recording, Replay};
use ratelab_system::System;

use super::{
    error::KeyError,
    frame::TRACE_S,
    knobs::{Direction, SPEEDS},
    overlap::{HeldOverlap, OverlapView, neighbour},
    run::{RunSource, StatusExtra, WatchedRows, watched},
    sampler::Sampler,
};

/// Run time between two samples of the push age.
const LOOK: Duration = Duration::from_millis(10);

/// A position in a recording. What is kept between frames for the moments up to it is in a
/// sampler.
pub struct Playback {
    replay: Replay,
    /// The ticks that overlap, once the run was executed again.
    overlaps: Vec<Overlap>,
    /// The run itself, held within ticks that overlap.
    held: Option<HeldOverlap>,
    observer: Observer,
    /// The chains behind all actions of the run.
    lineage: Lineage,
    /// The summary of the run, at its end.
    summary: Option<Summary>,
    /// Where it begins (run time).
    pub begins: Time,
    at: Time,
    /// Ratio of run time to wall time.
    pub speed: f64,
    /// Wall time at which `at` was reached, during playback.
    playing: Option<Instant>,
    /// Whether it is drawn frame by frame, whatever the wall time.
    filmed: bool,
}

/// Wall time that a short recording takes at least (s).
const MIN_WALL_S: f64 = 5.0;

impl Playback {
    /// Shows the beginning of `recording`, at rest, with its overlapping ticks if known.
    pub fn new(
        recording: Arc<Recording>,
        system: &Arc<dyn System>,
        overlaps: Vec<Overlap>,
    ) -> Self {
        let replay = Replay::new(recording, system);
        let begins = replay.begins();
        let lineage = replay.recording().lineage();
        let mut playback = Self {
            lineage: lineage.along(replay.system().about().latency_path()),
            observer: replay.observer(),
            replay,
            overlaps,
            held: None,
            summary: None,
            begins,
            at: begins,
            speed: 1.0,
            playing: None,
            filmed: false,
        };
        playback.advance_to(begins);
        playback
    }

    /// Goes on as `other` does: as fast, and playing if it plays.
    pub fn like(self, other: &Self) -> Self {
        let Self { speed, playing, .. } = *other;
        Self {
            speed,
            playing,
            ..self
        }
    }

    /// Returns the recording.
    pub fn recording(&self) -> Arc<Recording> {
        self.replay.recording().clone()
    }

    /// Returns the moment in sight.
    pub fn at(&self) -> Time {
        self.at
    }

    /// Returns where it ends (run time).
    pub fn ends(&self) -> Time {
        self.replay.recording().until.max(self.begins)
    }

    /// Shows the moment `at`, limited to the range of the recording.
    pub fn go(&mut self, at: Time, sampler: &mut Sampler) {
        let at = at.clamp(self.begins, self.ends());
        if at < self.at {
            self.rewind(sampler);
        }
        // What is sampled is there for the whole chart, from wherever one comes.
        let first = at - Duration::from_secs_f64(TRACE_S);
        let mut now = self.at.max(first);
        while now < at {
            self.advance_to(now);
            sampler.look(self);
            now = now + LOOK;
        }
        self.advance_to(at);
    }

    fn rewind(&mut self, sampler: &mut Sampler) {
        self.at = Time::ZERO;
        self.replay.rewind();
        self.observer = self.replay.observer();
        self.summary = None;
        *sampler = Sampler::default();
    }

    fn advance_to(&mut self, until: Time) {
        self.at = until;
        self.replay.advance_to(until);
        if self.replay.is_over() && self.summary.is_none() {
            self.summary = Some(self.replay.summary());
        }
    }

    /// Returns whether it plays.
    pub fn is_playing(&self) -> bool {
        self.playing.is_some()
    }

    /// Returns whether it plays, or is drawn as if it did.
    pub fn seems_to_play(&self) -> bool {
        self.is_playing() || (self.filmed && self.at < self.ends())
    }

    /// Is drawn frame by frame from now on, at `speed`.
    pub fn film(&mut self, speed: f64) {
        (self.filmed, self.speed) = (true, speed);
    }

    /// Slows down, so that a short recording can be watched.
    pub fn slow_down_if_short(&mut self) {
        let whole = self.ends().since(self.begins).as_secs_f64();
        let mut slower = SPEEDS
            .into_iter()
            .rev()
            .filter(|speed| whole / speed >= MIN_WALL_S);
        self.speed = slower.next().unwrap_or(SPEEDS[0]).min(self.speed);
    }

    /// Stands still.
    pub fn rest(&mut self) {
        self.playing = None;
    }

    /// Plays, from the beginning if it is at the end.
    pub fn play(&mut self, sampler: &mut Sampler) {
        if self.at == self.ends() {
            self.go(self.begins, sampler);
        }
        self.playing = Some(Instant::now());
    }

    /// Goes on playing from the moment in sight, whatever time has passed.
    pub fn go_on(&mut self) {
        self.playing = self.playing.map(|_| Instant::now());
    }

    /// Advances by the wall time since the last call, while it plays.
    pub fn follow(&mut self, sampler: &mut Sampler) {
        if let Some(since) = self.playing {
            let now = Instant::now();
            self.go(self.at + (now - since).mul_f64(self.speed), sampler);
            self.playing = Some(now).filter(|_| self.at < self.ends());
        }
    }

    /// Steps to the moment of the neighbouring messages; returns what happened there.
    pub fn step(&mut self, direction: Direction, sampler: &mut Sampler) -> Option<String> {
        self.rest();
        let (to, end) = match direction {
            Direction::Up => (self.replay.next(), Time::MAX),
            Direction::Down => (self.replay.previous(), self.begins),
        };
        self.go(to.unwrap_or(end), sampler);
        self.replay.happened()
    }

    /// Returns the moment of the neighbouring event.
    pub fn event(&self, direction: Direction) -> Option<Time> {
        let events = &self.replay.recording().events;
        let mut moments = events.iter().map(|event| event.at);
        match direction {
            Direction::Up => moments.find(|at| *at > self.at),
            Direction::Down => moments.rfind(|at| *at < self.at),
        }
    }
}

/// Ticks that overlap, operation by operation: the run itself, held between two of them.
impl Playback {
    /// Goes to the neighbouring operation of ticks that overlap; returns whether the run is
    /// on its way to other ticks than before.
    ///
    /// # Errors
    /// [`KeyError`] without such an operation.
    pub fn operate(
        &mut self,
        direction: Direction,
        sampler: &mut Sampler,
    ) -> Result<bool, KeyError> {
        self.rest();
        let later = direction == Direction::Up;
        let here = self.held.as_ref().map(|held| held.place);
        let Some((number, operations)) = neighbour(&self.overlaps, here, self.at, later) else {
            let none = match (self.overlaps.is_empty(), later) {
                (true, _) => "overlap in this run",
                (false, true) => "overlap after this",
                (false, false) => "overlapped before this",
            };
            return Err(KeyError::NoOverlap(none));
        };
        if let Some(held) = &mut self.held
            && held.goes_on_to((number, operations))
        {
            return Ok(false);
        }
        self.leave_overlap(sampler);
        let execution =
            Execution::new(self.recording(), self.replay.system()).map_err(KeyError::refused)?;
        self.go(self.overlaps[number].from - Time::RESOLUTION, sampler);
        self.held = HeldOverlap::begin(execution, (number, operations));
        Ok(true)
    }

    /// Leaves the ticks that overlap, to the moment before.
    pub fn leave_overlap(&mut self, sampler: &mut Sampler) {
        if self.held.take().is_some() {
            let at = self.at;
            self.rewind(sampler);
            self.go(at, sampler);
        }
    }

    /// Follows the run on its way to an operation; returns a notice if there is something new.
    pub fn follow_held(&mut self) -> Option<String> {
        match self.held.as_mut()?.follow() {
            Ok(new) => self.overlap().filter(|_| new).map(|it| it.sentence()),
            Err(progress) => Some(progress.to_string()),
        }
    }

    /// Returns the ticks that overlap in which the run is held.
    pub fn overlap(&self) -> Option<OverlapView> {
        let held = self.held.as_ref()?;
        let topology = &self.replay.recording().origin.topology;
        let ticks = &self.overlaps[held.place.0];
        Some(OverlapView::new(ticks, topology, held.done?))
    }
}

impl RunSource for Playback {
    fn shared_system(&self) -> &Arc<dyn System> {
        self.replay.system()
    }

    fn config(&self) -> &Config {
        self.replay.config()
    }

    fn observer(&self) -> &Observer {
        self.held
            .as_ref()
            .filter(|held| held.done.is_some())
            .map_or(&self.observer, |held| held.run.observer())
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
        rows.map(|topic| {
            let rows = self.replay.new_rows(&topic);
            (topic, rows)
        })
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

    fn status(&self) -> StatusExtra {
        StatusExtra {
            ended: self.summary.is_some(),
            replay: true,
            ..StatusExtra::default()
        }
    }
}
