//! The state of the dashboard, and the effects of keys on it: one model over a run here, a
//! recording, or a run of other processes.

mod choices;
mod course;
mod input;
pub mod keys;
mod knobs;
mod map;
mod past;
mod restart;
mod shown;
mod time;

use std::{sync::Arc, time::Duration};

use ratelab::{Event, Knob, Speed, Time};
use ratelab_experiment::{Config, own_world};
use ratelab_system::{System, WorldKind};

use course::CourseState;
use keys::{BACK, KeyTable, LAB, MAP, Need, REMOTE, REPLAY};
use knobs::{Knobs, without_knobs};
use map::LabMap;
use past::Executing;
use ratelab_recording::{FinishedRecording, RecordError, Recording};
use restart::{LabRecordings, LeftRun, Next};
use shown::{Shown, ShownRun};

use super::{
    frame::SignalTrace,
    playback::Playback,
    prompt::Prompt,
    run::{Remote, StatusExtra},
    sampler::Sampler,
    session::{Prepared, Session, SessionResult, SessionSetup},
    view::ScreenState,
};
use crate::error::ScreenError;

/// The dashboard: what is shown, and the user before it.
pub struct App {
    /// What is shown.
    pub(super) shown: Shown,
    /// The run here, while its past is shown.
    beneath: Option<Shown>,
    /// The run on the screen, while it is executed again.
    executing: Option<Executing>,
    /// The input line for a knob.
    pub(super) prompt: Prompt,
    /// The latest notice.
    pub(super) notice: Option<String>,
    /// Whether to quit.
    pub(super) quit: bool,
    /// Why the session failed at a key.
    failed: Option<ScreenError>,
    setup: SessionSetup,
    /// The settings of the next session, without its knobs.
    config: Config,
    /// The knobs turned so far, for the next session too.
    pub(super) knobs: Knobs,
    /// The knobs that undo the one that breaks the system, after that was turned.
    unbroken: Vec<Knob>,
    /// The system's own world, if any.
    own_world: Option<WorldKind>,
    /// The choices of the keys p and P.
    choices: Vec<String>,
    /// Whether the user has paused run time; the clock may follow later.
    pause: bool,
    /// Whether run time is paused because the program is being suspended.
    resting: bool,
    /// The step after the end of the session, if it is ending.
    next: Option<Next>,
    /// The run that the session left, if it is a branch.
    left: Option<LeftRun>,
    pub(super) recordings: LabRecordings,
    pub(super) course: CourseState,
    map: LabMap,
}

impl App {
    /// Starts the first session.
    ///
    /// # Errors
    /// [`ScreenError`] if it fails to start.
    pub fn new(config: &Config, setup: SessionSetup) -> Result<Self, ScreenError> {
        let mut recordings = LabRecordings::to(setup.record.clone());
        let prepared = Prepared::new(config, &setup)?;
        let recorder = recordings.begin(&prepared)?;
        let run = ShownRun::Live(Box::new(prepared.begin(recorder)));
        let config = run.config().clone();
        let mut app = Self {
            recordings,
            knobs: Knobs::new(config.setup.clone()),
            config: without_knobs(config),
            ..Self::with_run(run, setup)
        };
        app.enter_lab();
        Ok(app)
    }

    /// Shows the beginning of `recording`. A branch of it goes on in the lab.
    pub fn for_recording(recording: Arc<Recording>, setup: SessionSetup) -> Self {
        let system = recording.system(&setup.system);
        let notice = recording.defect();
        let playback = Playback::new(recording, &system, Vec::new());
        Self {
            notice,
            ..Self::with_run(
                ShownRun::Recorded(Box::new(playback)),
                SessionSetup { system, ..setup },
            )
        }
    }

    /// Shows a run of other processes.
    pub fn for_others(run: impl Remote + 'static) -> Self {
        let setup = SessionSetup::new(run.shared_system().clone(), None);
        let mut app = Self::with_run(ShownRun::Remote(Box::new(run)), setup);
        app.shown.mark_first();
        app
    }

    /// Shows `run`; what the lab adds is empty.
    fn with_run(run: ShownRun, setup: SessionSetup) -> Self {
        let mut shown = Shown::new(run);
        shown.sampler.hides_limits = setup.hides_limits;
        Self {
            shown,
            beneath: None,
            executing: None,
            prompt: Prompt::default(),
            notice: None,
            quit: false,
            failed: None,
            setup,
            config: Config {
                end: Time::MAX,
                speed: Speed::REAL_TIME,
                ..Config::default()
            },
            knobs: Knobs::default(),
            unbroken: Vec::new(),
            own_world: None,
            choices: Vec::new(),
            pause: false,
            resting: false,
            next: None,
            left: None,
            recordings: LabRecordings::default(),
            course: CourseState::default(),
            map: LabMap::default(),
        }
    }

    /// Looks around in the first session of the lab.
    fn enter_lab(&mut self) {
        self.shown.mark_first();
        let config = self.shown.run.config();
        self.choices = choices::available(self.system(), config);
        self.own_world = own_world(&self.setup.system, config);
        self.course.learner = config.seed;
    }

    /// Ends the session, if any; returns its result and the recordings. A session that failed
    /// to end before is abandoned.
    pub fn finish(mut self) -> Option<LabOutcome> {
        self.leave_past();
        let ending = self.next.is_some();
        let failed = self.failed.take();
        let ShownRun::Live(session) = &mut self.shown.run else {
            return None;
        };
        let ended = match failed {
            Some(error) => Err(error),
            None if ending => Err(session.abandon()),
            None => session.finish(),
        };
        self.finish_recordings();
        let verdict = ended
            .as_ref()
            .ok()
            .map(|ended| ended.summary.verdict.clone());
        let change = self.left.map(|left| left.change.sentence(verdict));
        Some(LabOutcome {
            ended,
            change,
            covered: self.course.covered,
            recorded: self.recordings.recorded,
            unrecorded: self.recordings.unrecorded,
        })
    }
}

/// The results of a lab.
#[derive(Debug)]
pub struct LabOutcome {
    /// The result of the last session.
    pub ended: Result<SessionResult, ScreenError>,
    /// What the last session changed, if it was a branch.
    pub change: Option<String>,
    /// Whether an exercise asks for the cause that the summary would name.
    pub covered: bool,
    /// Complete recordings.
    pub recorded: Vec<FinishedRecording>,
    /// The first recording that ended early.
    pub unrecorded: Option<RecordError>,
}

/// What is shown.
impl App {
    /// Takes a sample; returns whether there is something new to draw.
    ///
    /// # Errors
    /// [`ScreenError`] if what is shown failed.
    pub fn sample(&mut self) -> Result<bool, ScreenError> {
        if let Some(error) = self.failed.take() {
            return Err(error);
        }
        let measured = self.course.panel.as_mut().is_some_and(|panel| panel.poll());
        let moved = match &self.shown.run {
            ShownRun::Live(_) => self.follow_session()?,
            ShownRun::Recorded(_) => self.follow_playback(),
            ShownRun::Remote(_) => self.follow_others(),
        };
        let executed = self.follow_execution();
        let new = self.add_frame();
        Ok(measured | moved | executed | new)
    }

    fn follow_session(&mut self) -> Result<bool, ScreenError> {
        if let ShownRun::Live(session) = &mut self.shown.run {
            session.wait(Duration::ZERO)?;
        }
        self.follow_end(Duration::ZERO)?;
        for event in self.shown.new_events() {
            self.follow(&event);
        }
        self.follow_recordings();
        self.notice_outside();
        Ok(self.follow_map())
    }

    fn follow_others(&mut self) -> bool {
        let ShownRun::Remote(run) = &mut self.shown.run else {
            return false;
        };
        let (began, refusal) = (run.update(), run.refusal());
        if began {
            self.shown.begin(Sampler::default());
            self.shown.mark_first();
        }
        self.notice = refusal.or(self.notice.take());
        self.shown.new_events();
        // The time that somebody is gone for goes on, too.
        true
    }

    /// Adds a frame of what is shown; returns whether it is a new one.
    fn add_frame(&mut self) -> bool {
        self.shown.sampler.hides_limits = self.setup.hides_limits;
        let (mut frame, rows) = self.shown.frame();
        if self.is_live() {
            self.follow_rescue(&rows, &mut frame);
            self.follow_branch(&mut frame);
            self.cover_cause(&mut frame);
        }
        self.shown.frames.add(frame)
    }

    /// Returns the screen; `None` before the first sample.
    pub fn screen(&self) -> Option<ScreenState<'_>> {
        let (shown, system) = (&self.shown, self.system());
        let (frame, now) = (shown.frames.shown()?, shown.now()?);
        let events: Vec<Event> = shown
            .events
            .iter()
            .filter(|event| event.at <= now && self.may_show(event))
            .cloned()
            .collect();
        let playback = match &shown.run {
            ShownRun::Recorded(playback) => Some(&**playback),
            _ => None,
        };
        let trace = shown.sampler.trace(system, now, &events);
        let by_hand = self.course.by_hand.as_ref().filter(|_| self.is_live());
        let safe = by_hand.map(|by_hand| by_hand.rescue.safe());
        Some(ScreenState {
            system,
            frame,
            trace: trace.map(|trace| SignalTrace { safe, ..trace }),
            timeline: self.cover_timeline(shown.timeline(now)),
            overlap: playback.and_then(|playback| playback.overlap()),
            knob_focus: shown.knob_focus.clone(),
            events,
            extra: StatusExtra {
                back: shown.frames.position(),
                ..shown.run.status()
            },
            panes: shown.panes,
            scrubber: playback,
            map: self.visible_map(),
            page: self.page(frame),
            aside: self.tour_page(frame),
            hints: match shown.frames.position() {
                Some(_) => self.keys().hints_of(&BACK),
                None => self.keys().hints(|need| self.has_what(need)),
            },
            prompt: &self.prompt,
            notice: self.notice.as_deref(),
        })
    }

    /// Returns the table of keys that the help and the footer show.
    fn keys(&self) -> &'static KeyTable {
        match &self.shown.run {
            ShownRun::Live(_) if self.visible_map().is_some() => &MAP,
            ShownRun::Live(_) => &LAB,
            ShownRun::Recorded(_) => &REPLAY,
            ShownRun::Remote(_) => &REMOTE,
        }
    }

    /// Returns whether there is what a key needs.
    fn has_what(&self, needs: Need) -> bool {
        match needs {
            Need::Nothing => true,
            Need::Course => self.setup.course.is_some(),
            Need::Breakable => self.system().knobs().broken().is_some(),
            Need::Choices => !self.choices.is_empty(),
            Need::SecondRate => self.second_node().is_some(),
            Need::OwnWorld => self.own_world.is_some(),
            Need::Sides => self.sides() > 1,
        }
    }

    /// Returns the number of sides from which the plant can be seen.
    fn sides(&self) -> usize {
        self.system().robot().sides()
    }

    /// Looks at the plant from the next side.
    fn turn_plant(&mut self) {
        let next = self.shown.panes.side + 1;
        self.shown.panes.side = next % self.sides().max(1);
    }

    /// Returns whether the run is over.
    pub fn ended(&self) -> bool {
        self.shown.run.summary().is_some()
    }

    /// Returns the settings wanted by the user, which apply to the next session.
    pub fn wanted(&self) -> Config {
        Config {
            setup: self.knobs.wanted(),
            ..self.config.clone()
        }
    }

    /// Gives notice.
    fn notify(&mut self, notice: impl Into<String>) {
        self.notice = Some(notice.into());
    }

    fn system(&self) -> &dyn System {
        self.shown.run.system()
    }

    fn is_live(&self) -> bool {
        matches!(self.shown.run, ShownRun::Live(_))
    }

    /// Returns the run here, if it is shown.
    fn session(&self) -> Option<&Session> {
        match &self.shown.run {
            ShownRun::Live(session) => Some(session),
            _ => None,
        }
    }

    /// Returns the run here so far, to be executed again; `None` at its end.
    fn so_far(&self) -> Option<Arc<Recording>> {
        self.session()?.so_far().map(Arc::new)
    }
}
