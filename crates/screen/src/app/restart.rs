//! The end of a session, and the step after it.

use std::{sync::Arc, time::Duration};

use ratelab::{ClockKind, Time};
use ratelab_experiment::Config;
use ratelab_recording::{Change, Recording};

use super::{
    App,
    choices::as_it_is_now,
    course::ByHand,
    knobs::{Knobs, without_knobs},
    run::ShownRun,
};
use crate::{error::ScreenError, session::Prepared};

/// Maximum time that a key waits for the end of a session, or for a pause. After that,
/// the dashboard waits for a busy node frame by frame.
pub(super) const PATIENCE: Duration = Duration::from_millis(250);

/// The step after the end of a session.
pub(super) enum Next {
    /// Quit the dashboard.
    Leave,
    /// Another session.
    Session(Box<Start>),
}

/// The start of a session.
pub(super) struct Start {
    pub(super) prepared: Prepared,
    /// Whether it is a rescue by hand, recorded and judged.
    pub(super) by_hand: bool,
    /// The run that it leaves, if it is a branch.
    pub(super) left: Option<LeftRun>,
}

/// The run that a branch left.
pub(super) struct LeftRun {
    pub(super) recording: Arc<Recording>,
    /// Run time at which it was to be left.
    pub(super) asked: Time,
    /// What was changed there.
    pub(super) change: Change,
}

impl App {
    /// Leaves what is shown: the past of the run here, or the dashboard.
    pub(super) fn close(&mut self) {
        if !self.leave_past() {
            self.leave();
        }
    }

    /// Ends the session and quits.
    pub(super) fn leave(&mut self) {
        self.leave_past();
        self.end_with(Next::Leave);
    }

    /// Starts again with the knobs as they stand.
    pub(super) fn restart_as_it_stands(&mut self) {
        match self.course.by_hand {
            Some(_) => self.try_by_hand(),
            None => self.restart(self.wanted()),
        }
    }

    /// Ends this session and starts one of `config`, with the current content of files.
    /// If that fails, a notice gives the reason and this session continues.
    pub(super) fn restart(&mut self, config: Config) {
        self.start(config, false);
    }

    /// Does so; a session `by_hand` is a rescue, recorded and judged.
    pub(super) fn start(&mut self, config: Config, by_hand: bool) {
        let config = Config {
            setup: as_it_is_now(self.system(), &config.setup),
            ..config
        };
        match Prepared::new(&config, &self.setup) {
            Ok(prepared) => self.end_with(Next::Session(Box::new(Start {
                prepared,
                by_hand,
                left: None,
            }))),
            Err(error) => self.notify(error.to_string()),
        }
    }

    /// Ends what is shown, then takes the `next` step.
    pub(super) fn end_with(&mut self, next: Next) {
        if let ShownRun::Live(session) = &mut self.shown.run {
            session.stop();
        }
        self.next = Some(next);
        if let Err(error) = self.follow_end(PATIENCE) {
            self.failed = Some(error);
        }
    }

    /// Waits up to `patience` for the end of an ending session, then takes the next step;
    /// until then a notice names the busy nodes.
    pub(super) fn follow_end(&mut self, patience: Duration) -> Result<(), ScreenError> {
        let Some(next) = self.next.take() else {
            return Ok(());
        };
        if let ShownRun::Live(session) = &mut self.shown.run
            && !session.wait(patience)?
        {
            let busy = session.busy();
            let quit = match next {
                Next::Leave => "q again",
                Next::Session(_) => "q",
            };
            self.notify(format!(
                "waiting for {busy}, still in a tick: {quit} or Ctrl-C ends without it"
            ));
            self.next = Some(next);
            return Ok(());
        }
        match next {
            Next::Leave => self.quit = true,
            Next::Session(start) => self.begin(*start)?,
        }
        Ok(())
    }

    /// Starts the prepared session, after the end of what was shown.
    fn begin(&mut self, start: Start) -> Result<(), ScreenError> {
        let Start {
            prepared,
            by_hand,
            left,
        } = start;
        let live = self.is_live();
        if !live {
            // The whole recording is there to be compared with.
            self.jump(Time::MAX);
            self.shown.frame();
        }
        let sampler = self.shown.sampler.next(&*self.shown.run);
        if let ShownRun::Live(session) = &mut self.shown.run {
            match session.finish() {
                // The rows of a session with a successor are discarded.
                Ok(_) | Err(ScreenError::Csv(_)) => {}
                Err(error) => return Err(error),
            }
        }
        (self.notice, self.executing) = (None, None);
        self.follow_recordings();
        self.recordings.wanted |= by_hand;
        let recorder = self.recordings.begin(&prepared).unwrap_or_else(|error| {
            self.unrecordable(error);
            None
        });
        // A rescue is judged by its recording.
        let recording = recorder.as_ref().filter(|_| by_hand);
        let recording = recording.map(|recorder| recorder.path().to_owned());
        self.shown.run = ShownRun::Live(Box::new(prepared.begin(recorder)));
        self.shown.begin(sampler);
        self.config = without_knobs(self.shown.run.config().clone());
        self.knobs = Knobs::new(self.config.setup.clone());
        self.pause = false;
        let course = self.setup.course.as_ref();
        self.course.by_hand = course.zip(recording).map(|(course, recording)| ByHand {
            rescue: course.rescue(),
            recording,
        });
        if !live {
            self.enter_lab();
        }
        if let Some(left) = &left {
            self.config.clock = ClockKind::Virtual;
            self.notify(format!("left at {}", left.change.left(left.asked)));
        }
        self.left = left;
        Ok(())
    }
}
