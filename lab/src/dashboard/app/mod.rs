//! The state of the dashboard, and the effects of keys on it.

mod branch;
mod choices;
mod cliff;
mod exercises;
mod knobs;
mod past;
#[cfg(test)]
mod probe;
mod recording;
mod restart;
mod time;
mod tour;

use std::{path::PathBuf, time::Duration};

use crossterm::event::KeyEvent;
use ratelab::{Command, Event, Knob, Time};
use ratelab_study::{
    experiment::Config,
    system::{System, WorldKind},
};

use knobs::without_knobs;
use past::Past;
use restart::Next;

use super::{
    branch::{LeftRun, PreparedBranch},
    cliff::{CliffMap, MapAxes},
    desk::Desk,
    exercise_panel::ExercisePanel,
    focus::Pane,
    frame::{FrameData, SignalTrace},
    history::FrameHistory,
    keys::{LAB, LabAction, MAP, PaneAction, is_chord},
    knob_focus::KnobFocus,
    knobs::Knobs,
    model::Model,
    presets::{Direction, at_end},
    prompt::Vocabulary,
    sampler::{RunSource, Sampler},
    session::{Session, SessionResult, SessionSetup},
    tour::Tour,
    view::{Bottom, Page, ScreenState, StatusExtra},
};
use crate::{
    error::LabError,
    recording::{Destination, FinishedRecording, RecordError, Recorder},
    rescue::RescueTry,
    timing::own_world,
};

/// The dashboard: one session at a time, with its history and the position of the user in
/// it.
pub struct App {
    /// The settings of the next session, without its knobs.
    config: Config,
    /// The knobs turned so far, for the next session too.
    knobs: Knobs,
    /// The system's own world, if it has one.
    own_world: Option<WorldKind>,
    /// The choices of the keys p and P.
    choices: Vec<String>,
    /// Whether the user has paused run time; the clock may follow later.
    pause: bool,
    /// The events of the session so far.
    events: Vec<Event>,
    setup: SessionSetup,
    /// The current session.
    desk: Desk<Session>,
    /// The step after the end of the session, if it is ending.
    next: Option<Next>,
    /// Whether run time is paused because the program is being suspended.
    resting: bool,
    history: FrameHistory,
    /// The destination of the next recording.
    destination: Destination,
    /// Whether the user wants sessions recorded.
    record: bool,
    /// Recordings that are being completed.
    completing: Vec<Recorder>,
    /// Complete recordings.
    recorded: Vec<FinishedRecording>,
    /// The first recording that ended early.
    unrecorded: Option<RecordError>,
    /// The learner's number: the seed of the first session.
    learner: u64,
    /// The exercises, while they are open.
    panel: Option<ExercisePanel>,
    /// Whether the cause of a loss is covered, because an exercise asks for it.
    covered: bool,
    /// The position in the guided tour, during one.
    tour: Option<Tour>,
    /// The knobs that undo the one that breaks the system, after that was turned.
    unbroken: Vec<Knob>,
    /// The rescue by hand, which will be judged, if the session is one.
    by_hand: Option<RescueTry>,
    /// Whether the last key was that of the exercises, too early in a rescue.
    early: bool,
    /// The cliff map, after it was first opened.
    map: Option<CliffMap>,
    /// The quantities of its axes.
    map_axes: MapAxes,
    /// Whether the map is open.
    mapping: bool,
    /// The learner's predictions, if the map is to ask for that of what it shows.
    asks_first: Option<PathBuf>,
    /// The run that the session left, if it is a branch.
    left: Option<LeftRun>,
    /// The run while it is looked at again, tick by tick.
    past: Option<Past>,
}

impl App {
    /// Starts the first session.
    ///
    /// # Errors
    /// [`LabError`] if it fails to start.
    pub fn new(config: &Config, setup: SessionSetup) -> Result<Self, LabError> {
        let mut destination = setup.record.clone().unwrap_or_default();
        let record = setup.record.as_ref().map(|_| &mut destination);
        let session = Session::start(config, &setup, record)?;
        Ok(Self::of(session, setup, destination, config.seed))
    }

    /// Starts with a branch; `sampler` knows the run that it left.
    pub fn of_branch(
        (prepared, left): PreparedBranch,
        sampler: Sampler,
        setup: SessionSetup,
    ) -> Self {
        let session = prepared.begin(None);
        let seed = session.config().seed;
        let mut app = Self::of(session, setup, Destination::default(), seed);
        app.desk.sampler = sampler;
        app.begin_branch(Some(left));
        app
    }

    fn of(session: Session, setup: SessionSetup, destination: Destination, learner: u64) -> Self {
        Self {
            choices: choices::available(session.system(), session.config()),
            own_world: own_world(&setup.system, session.config()),
            config: without_knobs(session.config().clone()),
            knobs: Knobs::new(session.config().setup.clone()),
            pause: false,
            events: Vec::new(),
            desk: Desk {
                knob_focus: KnobFocus::new(session.system(), &session.observer().snapshot()),
                ..Desk::new(session)
            },
            next: None,
            resting: false,
            history: FrameHistory::default(),
            destination,
            record: setup.record.is_some(),
            setup,
            completing: Vec::new(),
            recorded: Vec::new(),
            unrecorded: None,
            learner,
            panel: None,
            covered: false,
            tour: None,
            unbroken: Vec::new(),
            by_hand: None,
            early: false,
            map: None,
            map_axes: MapAxes::default(),
            mapping: false,
            asks_first: None,
            left: None,
            past: None,
        }
    }

    /// Number of the visible frame and number of frames; `None` live.
    pub fn looking_back(&self) -> Option<(usize, usize)> {
        self.history.position()
    }

    /// Whether the run is over.
    pub fn ended(&self) -> bool {
        self.desk.run.summary().is_some()
    }

    /// Events up to `now`.
    pub fn events(&self, now: Time) -> impl Iterator<Item = &Event> {
        self.events.iter().filter(move |event| event.at <= now)
    }

    /// The settings wanted by the user, which apply to the next session.
    pub fn wanted(&self) -> Config {
        Config {
            setup: self.knobs.wanted(),
            ..self.config.clone()
        }
    }

    /// Ends the session; returns its result and the recordings. A session that failed to
    /// end before is abandoned.
    pub fn finish(mut self) -> LabOutcome {
        let ended = match self.next {
            None => self.desk.run.finish(),
            Some(_) => Err(self.desk.run.abandon()),
        };
        self.finish_recordings();
        let verdict = ended.as_ref().ok().map(|ended| ended.summary.verdict);
        let change = self.left.map(|left| left.change.sentence(verdict));
        LabOutcome {
            ended,
            change,
            recorded: self.recorded,
            unrecorded: self.unrecorded,
        }
    }
}

/// The results of a lab.
#[derive(Debug)]
pub struct LabOutcome {
    /// The result of the last session.
    pub ended: Result<SessionResult, LabError>,
    /// What the last session changed, if it was a branch.
    pub change: Option<String>,
    /// Complete recordings.
    pub recorded: Vec<FinishedRecording>,
    /// The first recording that ended early.
    pub unrecorded: Option<RecordError>,
}

impl Model for App {
    type Run = Session;

    fn desk(&self) -> &Desk<Session> {
        &self.desk
    }

    fn desk_mut(&mut self) -> &mut Desk<Session> {
        &mut self.desk
    }

    fn vocabulary(&self) -> Vocabulary<'_> {
        self.desk.vocabulary(&self.choices)
    }

    fn enter(&mut self, text: &str) -> Result<(), String> {
        match self.desk.prompt.branch() {
            Some(at) => self.branch(at, text),
            None => self.turn_typed(text),
        }
    }

    fn sample(&mut self) -> Result<bool, LabError> {
        self.desk.run.poll()?;
        self.follow_end(Duration::ZERO)?;
        self.follow_events();
        self.follow_recordings();
        self.notice_outside();
        let measured = self.panel.as_mut().is_some_and(ExercisePanel::poll);
        let new = measured | self.add_frame();
        self.desk.frame = self.history.shown();
        let mapped = self.follow_map();
        let played = self.follow_past()?;
        Ok(new || mapped || played)
    }

    fn screen(&self) -> Option<ScreenState<'_>> {
        if let Some(player) = self.player() {
            return player.screen();
        }
        let frame = self.desk.frame.as_deref()?;
        let events = self.events(frame.now).cloned().collect();
        let screen = self.desk.screen(frame.now, events)?;
        let safe = self.by_hand.as_ref().map(|_| RescueTry::SAFE_DEG);
        Some(ScreenState {
            trace: screen.trace.map(|trace| SignalTrace { safe, ..trace }),
            extra: StatusExtra {
                back: self.looking_back(),
                recording: self.recording(),
                ..screen.extra
            },
            map: self.open(),
            page: self.page(frame),
            aside: self.tour_page(frame),
            bottom: Bottom {
                hints: match self.mapping {
                    true => MAP.hints(|_| true),
                    false => LAB.hints(|action| self.knows(*action)),
                },
                ..screen.bottom
            },
            ..screen
        })
    }

    fn key(&mut self, key: &KeyEvent) -> Result<(), LabError> {
        let action = LAB.action(key);
        if self.next.is_some() {
            // A session that is ending ignores other keys.
            self.desk.quit |= action == Some(LabAction::Quit);
            return Ok(());
        }
        self.desk.notice = None;
        if !(action == Some(LabAction::Quit) && is_chord(key)) && self.is_for_the_past(key)? {
            return Ok(());
        }
        if self.is_typed(key, action == Some(LabAction::Quit)) {
            return Ok(());
        }
        if self.panel.is_some() && !is_chord(key) {
            return self.panel_key(key);
        }
        if self.is_for_the_tour(key) {
            return Ok(());
        }
        let on_map = MAP.action(key).filter(|_| self.mapping);
        let done = match (on_map, action) {
            (Some(action), _) => self.act_on_map(action),
            (None, Some(action)) => self.act(action),
            (None, None) => Ok(()),
        };
        self.desk.frame = self.history.shown();
        done
    }

    fn paste(&mut self, text: &str) {
        if let Some(Past::Playing(player)) = &mut self.past {
            player.paste(text);
        } else if self.desk.prompt.is_open() {
            self.desk.prompt.paste(text);
        } else if let Some(panel) = &mut self.panel {
            panel.paste(&text.replace(char::is_control, " "));
        }
    }

    fn rest(&mut self) {
        self.stand_still();
    }

    fn go_on(&mut self) {
        if let Some(Past::Playing(player)) = &mut self.past {
            player.go_on();
        }
        if std::mem::take(&mut self.resting) {
            self.desk.run.send(Command::Resume);
        }
    }
}

impl App {
    /// Adds a frame of the session; returns whether it is a new one.
    fn add_frame(&mut self) -> bool {
        let rows = self.desk.run.new_rows();
        let mut frame = self.desk.sampler.frame_data(&mut self.desk.run, &rows);
        self.follow_rescue(&rows, &mut frame);
        self.follow_branch(&mut frame);
        self.cover_cause(&mut frame);
        self.history.add(frame)
    }

    fn act(&mut self, action: LabAction) -> Result<(), LabError> {
        let early = std::mem::take(&mut self.early);
        match action {
            LabAction::Rate(direction) => self.turn_rate(direction),
            LabAction::SecondRate(direction) => self.turn_second_rate(direction),
            LabAction::Depth(direction) => self.turn_depth(direction),
            LabAction::Delay(direction) => self.turn_delay(direction),
            LabAction::Loss(direction) => self.turn_loss(direction),
            LabAction::Node(direction) => {
                let graph = self.desk.graph();
                self.desk.knob_focus.move_node(&graph, direction);
            }
            LabAction::Topic(direction) => {
                let graph = self.desk.graph();
                let system = self.desk.run.system();
                self.desk.knob_focus.move_topic(system, &graph, direction);
            }
            LabAction::Break => self.break_it(),
            LabAction::Type => self.desk.prompt.open(None),
            LabAction::Branch => self.ask_for_branch(),
            LabAction::Pause => self.pause(),
            LabAction::StepForward => self.step(),
            LabAction::StepBack => self.look_back(),
            LabAction::Oldest => self.history.oldest(),
            LabAction::Newest | LabAction::Live => self.history.live(),
            LabAction::Speed(direction) => self.change_speed(direction),
            LabAction::SpeedOne => self.set_speed(1.0),
            LabAction::OtherClock => self.other_clock(),
            LabAction::Map => self.ask_for_map(),
            LabAction::Record => self.toggle_recording(),
            LabAction::Exercises => self.open_exercises(early),
            LabAction::Tour => self.toggle_tour(),
            LabAction::Restart if self.by_hand.is_some() => return self.try_by_hand(),
            LabAction::Restart => return self.restart(self.wanted()),
            LabAction::OtherWorld => return self.other_world(),
            LabAction::Seed(direction) => return self.change_seed(direction),
            LabAction::Choice(direction) => self.choose(direction),
            LabAction::Panes(action) => self.focus_and_act(action),
            LabAction::Quit => return self.leave(),
        }
        Ok(())
    }

    /// The open page: over the panes, or of the exercises.
    fn page(&self, frame: &FrameData) -> Option<Page> {
        let rows = || match self.mapping {
            true => MAP.rows(|_| true),
            false => LAB.rows(|action| self.knows(*action)),
        };
        let over = self.desk.panes.page(rows, self.system(), frame);
        over.or_else(|| self.panel.as_ref().map(ExercisePanel::page))
    }

    /// Whether `action` has any use in this session.
    fn knows(&self, action: LabAction) -> bool {
        match action {
            LabAction::Exercises | LabAction::Tour => self.setup.course,
            LabAction::Break => self.system().about().broken.is_some(),
            LabAction::Choice(_) => !self.choices.is_empty(),
            LabAction::SecondRate(_) => self.second_node().is_some(),
            LabAction::OtherWorld => self.own_world.is_some(),
            _ => true,
        }
    }

    fn system(&self) -> &dyn System {
        self.desk.run.system()
    }

    /// Selecting another push in the timeline focuses the timeline.
    fn focus_and_act(&mut self, action: PaneAction) {
        let Some(now) = self.desk.frame.as_ref().map(|frame| frame.now) else {
            return;
        };
        if matches!(action, PaneAction::Push(_)) {
            self.desk.panes.focus = Pane::Timeline;
        }
        self.act_on_panes(action, now);
    }

    /// Whether the graph can still be changed; prints a notice if not.
    fn alive(&mut self) -> bool {
        if self.ended() {
            self.desk.notify("the run is over: r starts again");
        }
        !self.ended()
    }

    fn other_world(&mut self) -> Result<(), LabError> {
        let Some(own) = self.own_world else {
            self.desk.notify("this system has no world of its own");
            return Ok(());
        };
        let world = match self.config.world {
            WorldKind::Course => own,
            WorldKind::Own { .. } => WorldKind::Course,
        };
        self.restart(Config {
            world,
            ..self.wanted()
        })
    }

    fn change_seed(&mut self, direction: Direction) -> Result<(), LabError> {
        let seed = self.config.seed;
        let next = if direction == Direction::Up {
            seed.checked_add(1)
        } else {
            seed.checked_sub(1)
        };
        match next {
            Some(seed) => self.restart(Config {
                seed,
                ..self.wanted()
            }),
            None => {
                self.desk.notify(at_end("seed", direction, seed));
                Ok(())
            }
        }
    }
}
