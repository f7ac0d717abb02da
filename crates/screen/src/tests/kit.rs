//! What the tests of the dashboard have in common.

use std::{
    collections::VecDeque,
    fs::File,
    io,
    path::PathBuf,
    sync::atomic::{AtomicBool, Ordering},
    thread,
};

use crossterm::event::{Event, KeyEvent, KeyModifiers};
use ratatui::{Terminal, backend::TestBackend};
use ratelab::Knob;
use ratelab_cart_pole::{Action, Observation, policy::Policy};
use ratelab_recording::Destination;

pub use super::testing::{POOR, RICH};
use super::{
    super::{LabOutcome, OpenRows, Options, frame::FrameData, run, terminal::Input},
    *,
};
use crate::error::ScreenError;

/// The cart-pole, nothing recorded.
pub fn setup() -> SessionSetup {
    SessionSetup::new(Arc::new(CartPole::default()), Some("answers.toml".into()))
}

/// The same, recorded to `folder`.
pub fn recording_to(folder: &Path) -> SessionSetup {
    SessionSetup {
        record: Some(Destination::new(Some(folder.to_owned()))),
        ..setup()
    }
}

/// Opens the file at `path`, and empties it when a session begins.
pub fn rows_to(path: PathBuf) -> OpenRows {
    Arc::new(move || {
        let mut options = File::options();
        let file = options
            .write(true)
            .create(true)
            .truncate(false)
            .open(&path)?;
        Ok(Box::new(move || {
            file.set_len(0)?;
            Ok(Box::new(file) as _)
        }))
    })
}

pub fn knob(text: &str) -> Knob {
    text.parse().expect("a knob")
}

pub fn seconds(seconds: f64) -> Time {
    Time::from_secs_f64(seconds).expect("a time")
}

/// A run of ten seconds, flat out, with timed `knobs`.
pub fn timed(knobs: &str) -> Config {
    Config {
        knobs: CartPole::KNOBS.parse_list(knobs).expect("knobs"),
        ..Config::default()
    }
}

/// A run that has no end.
pub fn endless() -> Config {
    Config {
        speed: Speed::REAL_TIME,
        end: Time::MAX,
        ..Config::default()
    }
}

pub fn session(config: Config) -> App {
    App::new(&config, setup()).expect("session")
}

/// A session whose run has no end.
pub fn running() -> App {
    let mut app = session(endless());
    sample(&mut app);
    app
}

/// A session whose run is over.
pub fn ended(config: Config) -> App {
    let mut app = session(config);
    end(&mut app);
    app
}

/// A run that ended on its own, flat out, with the pole down.
pub fn fallen() -> App {
    ended(timed("0.5 control-hz 5\n1.5 queue-depth 100"))
}

/// A frame of the session, or of its past.
pub fn sample(app: &mut App) {
    app.sample().expect("no fault");
}

/// Samples until `what` is so.
pub fn until(app: &mut App, what: impl Fn(&App) -> bool) {
    while !what(app) {
        sample(app);
        thread::yield_now();
    }
}

/// Samples until the run is over.
pub fn end(app: &mut App) {
    until(app, App::ended);
    sample(app);
}

/// The results of a lab.
pub fn left(app: App) -> LabOutcome {
    app.finish().expect("a session")
}

/// Leaves a run that goes on.
pub fn leave(app: App) {
    left(app).ended.expect("no fault");
}

pub fn key(app: &mut App, code: KeyCode) {
    app.key(&KeyEvent::new(code, KeyModifiers::NONE));
}

pub fn press(app: &mut App, keys: &str) {
    chars(keys).into_iter().for_each(|code| key(app, code));
}

pub fn chars(text: &str) -> Vec<KeyCode> {
    let key = |letter| match letter {
        '\n' => KeyCode::Enter,
        letter => KeyCode::Char(letter),
    };
    text.chars().map(key).collect()
}

pub fn terminal(width: u16, height: u16) -> Terminal<TestBackend> {
    Terminal::new(TestBackend::new(width, height)).expect("terminal")
}

/// The screen as it is drawn.
pub fn drawn(app: &App, theme: &Theme, width: u16, height: u16) -> TestBackend {
    let mut terminal = terminal(width, height);
    terminal
        .draw(|frame| view::render(app.screen().as_ref(), theme, frame))
        .expect("drawn");
    terminal.backend().clone()
}

pub fn screen(app: &App, width: u16, height: u16) -> String {
    drawn(app, &RICH, width, height).to_string()
}

/// The screen of the default terminal.
pub fn small(app: &App) -> String {
    screen(app, 80, 24)
}

/// A screen with all panes.
pub fn large(app: &App) -> String {
    screen(app, 160, 50)
}

/// Each of `parts` is in what was `drawn`.
#[track_caller]
pub fn shows(drawn: &str, parts: &[&str]) {
    for part in parts {
        assert!(drawn.contains(part), "no {part:?} in\n{drawn}");
    }
}

/// The frame that is shown.
pub fn frame(app: &App) -> FrameData {
    app.screen().expect("a frame").frame.clone()
}

/// The ticks of all nodes in that frame.
pub fn ticks(app: &App) -> u64 {
    frame(app).nodes.iter().map(|node| node.ticks).sum()
}

/// The latest notice.
pub fn said(app: &App) -> &str {
    app.notice.as_deref().unwrap_or_default()
}

/// The headline of the newest frame, and its reasons.
pub fn verdict(app: &App) -> String {
    let verdict = frame(app).verdict;
    format!("{} {}", verdict.headline, verdict.why.join(" "))
}

/// The rate of `node` that the next session begins with, if it is set.
pub fn rate(app: &App, node: &str) -> Option<f64> {
    app.wanted().setup.rate(node).map(ratelab::Hz::get)
}

/// The knobs that the next session begins with.
pub fn set(app: &App) -> Vec<String> {
    let setup = app.wanted().setup;
    setup.iter().map(ToString::to_string).collect()
}

/// A policy that decides what its closure does.
#[derive(Clone)]
pub struct Decides<F>(pub F);

impl<F: FnMut() -> Action + Send> Policy for Decides<F> {
    fn name(&self) -> &str {
        "tested"
    }

    fn act(&mut self, _: &Observation) -> Action {
        (self.0)()
    }
}

/// The recording of a session of `config`, begun at run time `from` (s).
pub fn recorded(setup: SessionSetup, config: &Config, from: f64) -> Recording {
    let folder = tempfile::tempdir().expect("a folder");
    let setup = SessionSetup {
        record: recording_to(folder.path()).record,
        ..setup
    };
    let mut app = App::new(config, setup).expect("session");
    if from > 0.0 {
        press(&mut app, "w");
        until(&mut app, |app| {
            let screen = app.screen();
            screen.is_some_and(|screen| screen.frame.now >= seconds(from))
        });
        press(&mut app, "w");
    }
    end(&mut app);
    let recorded = left(app).recorded;
    Recording::read(&recorded.last().expect("a recording").path).expect("readable")
}

/// Types a key per frame, and notes when there are no more.
#[derive(Default)]
pub struct Typist {
    pub keys: VecDeque<KeyCode>,
    pub done: Arc<AtomicBool>,
}

impl Input for Typist {
    fn next(&mut self, timeout: Duration) -> io::Result<Option<Event>> {
        thread::sleep(timeout);
        let key = self.keys.pop_front();
        self.done.store(self.keys.is_empty(), Ordering::Relaxed);
        Ok(key.map(|code| Event::Key(KeyEvent::new(code, KeyModifiers::NONE))))
    }
}

/// Runs the real loop over `app` until it is left, or no `keys` are left for it.
pub fn in_the_loop(app: &mut App, keys: &[KeyCode]) -> Result<(), ScreenError> {
    let options = Options {
        fps: 30,
        theme: RICH,
        ask_background: false,
        quit_on_signal: Arc::default,
    };
    let mut typist = Typist {
        keys: keys.iter().copied().collect(),
        ..Typist::default()
    };
    let quit = match keys {
        [] => Arc::default(),
        _ => typist.done.clone(),
    };
    run(&mut terminal(120, 40), &mut typist, app, &options, &quit)
}

/// Runs the real loop over `config` with one key per frame; the session goes on.
pub fn typed(config: Config, keys: &str) -> App {
    let mut app = session(config);
    let keys = [chars(keys), vec![KeyCode::Null; 2]].concat();
    in_the_loop(&mut app, &keys).expect("the loop ended in order");
    app
}
