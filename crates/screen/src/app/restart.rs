//! The end of a session, its recordings, and the step after it.

use std::{sync::Arc, time::Duration};

use ratelab::{ClockKind, Time};
use ratelab_experiment::Config;
use ratelab_recording::{
    Change, Destination, FinishedRecording, RecordError, Recorder, Recording, StopReason, outside,
};

use super::{
    App,
    choices::as_it_is_now,
    course::ByHand,
    knobs::{Knobs, without_knobs},
    shown::ShownRun,
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

/// The recordings of all sessions.
#[derive(Default)]
pub struct LabRecordings {
    /// The destination of the next one.
    pub destination: Destination,
    /// Whether the user wants sessions recorded.
    pub wanted: bool,
    /// Recorders that are being completed.
    completing: Vec<Recorder>,
    /// Complete ones.
    pub recorded: Vec<FinishedRecording>,
    /// The first that ended early.
    pub unrecorded: Option<RecordError>,
}

impl LabRecordings {
    /// Creates recordings to `destination`; without one they are not wanted.
    pub fn to(destination: Option<Destination>) -> Self {
        Self {
            wanted: destination.is_some(),
            destination: destination.unwrap_or_default(),
            ..Self::default()
        }
    }

    /// Begins the recording of a `prepared` session, if it is wanted.
    ///
    /// # Errors
    /// [`ScreenError::Record`] with the system's error for the file.
    pub fn begin(&mut self, prepared: &Prepared) -> Result<Option<Recorder>, ScreenError> {
        self.wanted
            .then(|| prepared.record(&mut self.destination))
            .transpose()
    }
}

impl App {
    /// Starts a recording, or ends it.
    pub(super) fn record(&mut self) {
        if let ShownRun::Remote(run) = &mut self.shown.run {
            let notice = run.record();
            return self.notify(notice);
        }
        if self.ended() {
            self.recordings.wanted = !self.recordings.wanted;
            return self.notify(if self.recordings.wanted {
                "the run is over: r starts one that is recorded"
            } else {
                "the run is over, and the next is not recorded"
            });
        }
        if self.end_recording() {
            return self.follow_recordings();
        }
        let ShownRun::Live(session) = &mut self.shown.run else {
            return;
        };
        match session.record(&mut self.recordings.destination) {
            Ok(path) => {
                self.recordings.wanted = true;
                self.notify(format!("recording to {}", path.display()));
            }
            Err(error) => self.notify(error.to_string()),
        }
    }

    /// Ends the recording of the session; returns whether there is one.
    pub(super) fn end_recording(&mut self) -> bool {
        let recorder = self.session().and_then(|session| session.recorder.as_ref());
        let recorded = recorder
            .map(|recorder| recorder.end(StopReason::Off))
            .is_some();
        self.recordings.wanted &= !recorded;
        recorded
    }

    /// Checks for ended recordings; the end takes a moment.
    pub(super) fn follow_recordings(&mut self) {
        self.complete(|recorder| recorder.has_ended());
    }

    /// Waits for all recordings of past sessions.
    pub(super) fn finish_recordings(&mut self) {
        self.complete(|_| true);
    }

    /// Notes the results of the recordings that are to be `done`, and waits for them.
    fn complete(&mut self, done: fn(&Recorder) -> bool) {
        if let ShownRun::Live(session) = &mut self.shown.run {
            let ending = session.recorder.take_if(|recorder| recorder.is_ending());
            self.recordings.completing.extend(ending);
        }
        let completing = &mut self.recordings.completing;
        let done = completing.extract_if(.., |recorder| done(recorder));
        for recorder in done.collect::<Vec<_>>() {
            self.note_recorded(recorder);
        }
    }

    /// Stores the result of an ending recording.
    fn note_recorded(&mut self, recorder: Recorder) {
        match recorder.finish() {
            Ok(recorded) => {
                let defect = recorded.defect().map(|defect| format!(": {defect}"));
                let path = recorded.path.display();
                self.notify(format!("recorded {path}{}", defect.unwrap_or_default()));
                self.recordings.recorded.push(recorded);
            }
            Err(error) => {
                self.notify(error.to_string());
                self.is_unrecorded(error);
            }
        }
    }

    /// Goes on without a recording; the exit code reports it as well.
    fn is_unrecorded(&mut self, error: RecordError) {
        self.recordings.wanted = false;
        self.recordings.unrecorded.get_or_insert(error);
    }

    /// Goes on without a recording that cannot begin.
    pub(super) fn unrecordable(&mut self, error: ScreenError) {
        self.notify(error.to_string());
        if let ScreenError::Record(error) = error {
            self.is_unrecorded(error);
        }
    }

    /// Gives notice of what a thread outside of the graph wrote to, once for each.
    pub(super) fn notice_outside(&mut self) {
        let ShownRun::Live(session) = &mut self.shown.run else {
            return;
        };
        let names = session.written_from_outside();
        if !names.is_empty() {
            self.notify(outside(&names.join(" and ")));
        }
    }
}
