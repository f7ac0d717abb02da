//! The past of a run, and branches of it.

use std::{
    panic::resume_unwind,
    sync::Arc,
    thread::{self, JoinHandle},
};

use ratelab::{ClockKind, Command, Event, Time};
use ratelab_metrics::Observer;
use ratelab_recording::{Change, Departure, Executed, Execution, Recording, VerifyError, branch};
use ratelab_system::System;

use super::{
    App,
    restart::{LeftRun, Next, Start},
    shown::{Shown, ShownRun},
};
use crate::{
    error::KeyError, frame::FrameData, panes::Panes, playback::Playback, sampler::Sampler,
    session::Prepared,
};

/// A run that is executed again on a thread of its own.
pub struct Executing {
    thread: JoinHandle<Result<Executed, VerifyError>>,
    observer: Observer,
    until: Time,
}

impl Executing {
    /// Begins to execute the run of `recording` again.
    ///
    /// # Errors
    /// [`VerifyError`] if it cannot be executed again.
    fn start(recording: Arc<Recording>, system: &Arc<dyn System>) -> Result<Self, VerifyError> {
        let execution = Execution::new(recording.clone(), system)?;
        let (observer, until) = (execution.observer(), recording.until);
        Ok(Self {
            thread: thread::spawn(move || execution.run()),
            observer,
            until,
        })
    }

    /// Returns how far it is.
    fn progress(&self) -> String {
        let now = self.observer.now();
        format!("executing the run again: {now} of {}", self.until)
    }

    /// Returns the run.
    ///
    /// # Errors
    /// [`VerifyError`] if it is another run.
    fn finish(self) -> Result<Executed, VerifyError> {
        self.thread
            .join()
            .unwrap_or_else(|panic| resume_unwind(panic))
    }
}

impl App {
    /// Returns whether the run is at rest and was under the real clock, so that it can be executed
    /// again tick by tick.
    fn has_past(&self) -> bool {
        let handed_over = |event: &Event| {
            let command = event.applied();
            matches!(command, Some(Command::HandOver(ClockKind::Real)))
        };
        let real = self.shown.run.config().clock == ClockKind::Real;
        let real = real || self.shown.events.iter().any(handed_over);
        real && self.shown.run.at_rest()
    }

    /// Looks back: at the run itself if it can be executed again, or else at the picture
    /// before.
    pub(super) fn look_back(&mut self) {
        if self.shown.frames.position().is_none() && self.has_past() {
            match self.so_far() {
                Some(recording) => self.execute(recording, |error| error.to_string()),
                None => self.notify("this run is gone: r starts again"),
            }
        } else if !self.shown.frames.back() {
            self.notify("this is the oldest picture kept");
        }
    }

    /// Begins to execute the run of the recording again, if that is possible: its rows are
    /// shown until then.
    pub fn execute_again(&mut self) {
        if let ShownRun::Recorded(playback) = &self.shown.run
            && playback.recording().is_whole()
        {
            self.execute(playback.recording(), from_rows);
        }
    }

    fn execute(&mut self, recording: Arc<Recording>, why: fn(&VerifyError) -> String) {
        match Executing::start(recording, self.shown.run.shared_system()) {
            Ok(executing) => self.executing = Some(executing),
            Err(error) => self.notify(why(&error)),
        }
    }

    /// Follows the run that is executed again, and shows it once it is there; returns whether
    /// there is something new.
    pub(super) fn follow_execution(&mut self) -> bool {
        let (live, executing) = (self.is_live(), &mut self.executing);
        let Some(executed) = executing.take_if(|it| it.thread.is_finished()) else {
            let progress = executing.as_ref().filter(|_| live).map(Executing::progress);
            let goes_on = progress.is_some();
            self.notice = progress.or(self.notice.take());
            return goes_on;
        };
        match executed.finish() {
            Ok(executed) if live => self.open_past(executed),
            Ok(executed) => self.play_executed(executed),
            Err(error) if live => self.notify(error.to_string()),
            Err(error) => self.notify(from_rows(&error)),
        }
        true
    }

    /// Shows the end of the run here as it was executed again, in place of its pictures.
    fn open_past(&mut self, executed: Executed) {
        let system = &self.setup.system;
        let playback = Playback::new(executed.recording, system, executed.overlaps);
        let mut past = Shown::new(ShownRun::Recorded(Box::new(playback)));
        past.panes = Panes {
            overlay: None,
            ..self.shown.panes
        };
        past.go(Time::MAX);
        self.beneath = Some(std::mem::replace(&mut self.shown, past));
        self.notify("the run itself: , and . step, B branches, q returns to the lab");
    }

    /// Shows the run here again; returns whether its past was shown.
    pub(super) fn leave_past(&mut self) -> bool {
        let Some(live) = self.beneath.take() else {
            return false;
        };
        self.shown = live;
        true
    }

    /// Plays the run of the recording as it was executed again, from the same moment.
    fn play_executed(&mut self, executed: Executed) {
        let ShownRun::Recorded(before) = &self.shown.run else {
            return;
        };
        let more = ticks(&executed.recording) > ticks(&before.recording());
        let system = self.shown.run.shared_system();
        let playback = Playback::new(executed.recording, system, executed.overlaps).like(before);
        let at = before.at();
        self.shown.events = playback.recording().events.clone();
        self.shown.run = ShownRun::Recorded(Box::new(playback));
        self.shown.sampler = Sampler::default();
        self.shown.go(at);
        if more {
            self.notify("executed again: this is the whole run, from its start");
        }
    }
}

/// Returns the number of ticks in a recording.
fn ticks(recording: &Recording) -> usize {
    recording.ticks.iter().map(Vec::len).sum()
}

/// Returns the notice that a recording is shown as it is.
fn from_rows(why: &VerifyError) -> String {
    format!("shown from its rows: {}; verify prints more", why.brief())
}

impl App {
    /// Opens the prompt for the knob of a branch at the visible moment; in a branch, for
    /// another branch of the same run.
    pub(super) fn ask_for_branch(&mut self) {
        if let Some((playback, _)) = self.playback() {
            playback.rest();
        }
        let left = self.left.as_ref().filter(|_| self.is_live());
        if let Some(now) = self.shown.now() {
            let at = left.map_or(now, |left| left.change.at.min(now));
            self.prompt.open(Some(at));
        }
    }

    /// Returns the run so far, to be executed again; of a branch, the run that it left.
    fn run_to_leave(&self) -> Option<Arc<Recording>> {
        match (&self.shown.run, &self.left) {
            (ShownRun::Recorded(playback), _) => Some(playback.recording()),
            (_, Some(left)) => Some(left.recording.clone()),
            _ => self.so_far(),
        }
    }

    /// Ends this run and starts a branch of it at run time `at`, with the knobs in `text`:
    /// at the speed and until the end of the session, or for some seconds if it is left there.
    pub(super) fn branch(&mut self, at: Time, text: &str) -> Result<(), KeyError> {
        let recording = self.run_to_leave().ok_or(KeyError::RunGone)?;
        let system = &self.setup.system;
        let departure = Departure {
            at,
            knobs: self.parsed(text)?,
            end: Some(self.config.end).filter(|end| *end > at),
            speed: self.config.speed,
        };
        let branch = branch(&recording, system, &departure).map_err(KeyError::refused)?;
        let left = LeftRun {
            change: Change::new(&recording, &**system, branch.at, text.to_owned()),
            asked: at,
            recording,
        };
        let prepared = Prepared::for_branch(branch, &self.setup);
        let start = Start {
            prepared: prepared.map_err(KeyError::refused)?,
            by_hand: false,
            left: Some(left),
        };
        self.leave_past();
        self.end_with(Next::Session(Box::new(start)));
        Ok(())
    }

    /// Adds what the branch changed to `frame`, if the session is one.
    pub(super) fn follow_branch(&self, frame: &mut FrameData) {
        let verdict = self
            .shown
            .run
            .summary()
            .map(|summary| summary.verdict.clone());
        let sentence = self.left.as_ref().map(|left| left.change.sentence(verdict));
        frame.verdict.why.splice(0..0, sentence);
    }
}
