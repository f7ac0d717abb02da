//! The end of a session, and the step after it.

use std::{
    thread,
    time::{Duration, Instant},
};

use ratelab::{ClockKind, Command};
use ratelab_study::experiment::Config;

use super::{App, choices::as_it_is_now, knobs::without_knobs};
use crate::{
    dashboard::{
        branch::LeftRun,
        history::FrameHistory,
        knobs::Knobs,
        sampler::RunSource,
        session::{Prepared, list},
        timeline::TimelineView,
    },
    error::LabError,
    recording::RecordError,
    rescue::RescueTry,
};

/// Maximum time that a key waits for the end of a session, or for a pause. After that,
/// the dashboard waits for a busy node frame by frame.
const PATIENCE: Duration = Duration::from_millis(250);

/// The step after the end of a session.
pub(super) enum Next {
    /// Quit the dashboard.
    Leave,
    /// Another session.
    Session {
        prepared: Box<Prepared>,
        /// Whether it is a rescue by hand, recorded and judged.
        by_hand: bool,
        /// The run that it leaves, if it is a branch.
        left: Option<LeftRun>,
    },
}

impl App {
    /// Ends this session and quits.
    pub(super) fn leave(&mut self) -> Result<(), LabError> {
        self.end_with(Next::Leave)
    }

    /// Ends this session and starts one of `config`, with the current content of files.
    /// If that fails, a notice gives the reason and this session continues.
    pub(super) fn restart(&mut self, config: Config) -> Result<(), LabError> {
        self.start(config, false)
    }

    /// The same; a session `by_hand` is a rescue, recorded and judged.
    pub(super) fn start(&mut self, config: Config, by_hand: bool) -> Result<(), LabError> {
        match self.prepared(config).map(Box::new) {
            Ok(prepared) => self.end_with(Next::Session {
                prepared,
                by_hand,
                left: None,
            }),
            Err(reason) => {
                self.desk.notify(reason);
                Ok(())
            }
        }
    }

    fn prepared(&self, config: Config) -> Result<Prepared, String> {
        let config = Config {
            setup: as_it_is_now(self.system(), &config.setup),
            ..config
        };
        Prepared::new(&config, &self.setup).map_err(|error| error.to_string())
    }

    fn end_with(&mut self, next: Next) -> Result<(), LabError> {
        self.desk.run.stop();
        self.next = Some(next);
        self.follow_end(PATIENCE)
    }

    /// Waits up to `patience` for the end of an ending session, then takes the next step;
    /// until then a notice names the busy nodes.
    pub(super) fn follow_end(&mut self, patience: Duration) -> Result<(), LabError> {
        let Some(next) = self.next.take() else {
            return Ok(());
        };
        if self.desk.run.wait(patience)? {
            match next {
                Next::Leave => self.desk.quit = true,
                Next::Session {
                    prepared,
                    by_hand,
                    left,
                } => {
                    self.begin(*prepared, by_hand)?;
                    self.begin_branch(left);
                }
            }
        } else {
            let quit = match next {
                Next::Leave => "q again",
                Next::Session { .. } => "q",
            };
            self.desk.notify(format!(
                "waiting for {}, still in a tick: {quit} or Ctrl-C ends without it",
                list(&self.desk.run.busy())
            ));
            self.next = Some(next);
        }
        Ok(())
    }

    /// Starts the prepared session, after the end of the previous one.
    fn begin(&mut self, prepared: Prepared, by_hand: bool) -> Result<(), LabError> {
        let sampler = self.desk.sampler.next(&self.desk.run);
        match self.desk.run.finish() {
            // The rows of a session with a successor are discarded.
            Ok(_) | Err(LabError::Csv(_)) => {}
            Err(error) => return Err(error),
        }
        (self.desk.notice, self.past) = (None, None);
        self.follow_recordings();
        self.record |= by_hand;
        let record = self.record.then(|| prepared.record(&mut self.destination));
        let recorder = record.transpose().unwrap_or_else(|error| {
            self.unrecordable(error);
            None
        });
        self.desk.run = prepared.begin(recorder);
        self.config = without_knobs(self.desk.run.config().clone());
        self.knobs = Knobs::new(self.config.setup.clone());
        self.desk.sampler = sampler;
        self.history = FrameHistory::default();
        self.desk.panes.timeline = TimelineView::default();
        self.events.clear();
        self.pause = false;
        // A rescue is judged by its recording.
        self.by_hand = (by_hand && self.record).then(RescueTry::default);
        Ok(())
    }

    /// Follows a session that began as a branch of the run in `left`, if it did.
    pub(super) fn begin_branch(&mut self, left: Option<LeftRun>) {
        if let Some(left) = &left {
            self.config.clock = ClockKind::Virtual;
            self.desk
                .notify(format!("left at {}", left.change.left(left.asked)));
        }
        self.left = left;
    }

    /// Continues the session without a recording; the exit code reports it as well.
    fn unrecordable(&mut self, error: LabError) {
        self.desk.notify(error.to_string());
        self.record = false;
        if let LabError::Record { path, why } = error {
            self.unrecorded.get_or_insert(RecordError { path, why });
        }
    }

    /// Pauses run time while the program is suspended: under either clock it would
    /// otherwise jump ahead afterwards, and every period in between would count as an
    /// overrun.
    pub(super) fn stand_still(&mut self) {
        if self.pause || self.resting || self.ended() {
            return;
        }
        self.resting = true;
        self.desk.run.send(Command::Pause);
        let asked = Instant::now();
        // The program is suspended even with a busy graph.
        while !self.desk.run.observer().status().paused && asked.elapsed() < PATIENCE {
            thread::sleep(Duration::from_millis(1));
        }
    }
}
