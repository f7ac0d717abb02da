//! What the tests of the dashboard have in common.

use std::thread;

use crossterm::event::{KeyEvent, KeyModifiers};
use ratatui::{Terminal, backend::TestBackend};
use ratelab::Knob;
use ratelab_cart_pole::{Observation, policy::Policy};
use ratelab_recording::Destination;
use ratelab_system::{System, graph_file::GraphFile};

use super::{
    super::{LabOutcome, frame::FrameData},
    *,
};
pub use super::{
    course::TestCourse,
    table::rows,
    testing::{POOR, RICH, shows},
};

/// The cart-pole, nothing recorded.
pub fn setup() -> SessionSetup {
    SessionSetup::new(
        Arc::new(CartPole::default()),
        Some(Arc::new(TestCourse::default())),
    )
}

/// A session that is recorded to `folder`.
pub fn recording_to(folder: &Path) -> SessionSetup {
    SessionSetup {
        record: Some(Destination::from(Some(folder.to_owned()))),
        ..setup()
    }
}

/// A session with a policy that decides what `decides` does.
pub fn deciding<F>(decides: F) -> SessionSetup
where
    F: FnMut() -> Action + Clone + Send + Sync + 'static,
{
    let system = CartPole::with_policy(move |_| Box::new(Decides(decides.clone())));
    SessionSetup::new(Arc::new(system), setup().course)
}

/// The system of the graph file `text`.
pub fn graph(text: &str) -> Arc<dyn System> {
    let graph = GraphFile::parse(text).expect("a graph");
    let system = graph.system(&[setup().system]).expect("a graph");
    Arc::new(system)
}

pub fn knob(text: &str) -> Knob {
    text.parse().expect("a knob")
}

pub fn seconds(seconds: f64) -> Time {
    Time::from_secs_f64(seconds).expect("a time")
}

/// A run of the cart-pole, of ten seconds, at full speed, with knobs that are set before or turned at
/// a run time (s), such as `control-hz 5; 2 crash sensor`. Others: `real` clock, `own` world,
/// `seed N`, `speed X`, `until S`.
pub fn config(run: &str) -> Config {
    let mut config = Config::default();
    for text in run.split("; ").filter(|text| !text.is_empty()) {
        let (word, value) = text.split_once(' ').unwrap_or((text, ""));
        match word {
            "real" => config.clock = ClockKind::Real,
            "own" => config.world = WorldKind::OWN,
            "seed" => config.seed = value.parse().expect(text),
            "speed" => config.speed = Speed::times(value.parse().expect(text)).expect(text),
            "until" => config.end = value.parse().map_or(Time::MAX, seconds),
            time if time.parse::<f64>().is_ok() => {
                let knobs = CartPole::KNOBS.parse_list(text);
                config.knobs.extend(knobs.expect(text));
            }
            _ => config
                .setup
                .extend(CartPole::KNOBS.parse(text).expect(text)),
        }
    }
    config
}

/// A run in real time that has no end.
pub fn endless(run: &str) -> Config {
    config(&format!("speed 1; until ever; {run}"))
}

pub fn opened(setup: SessionSetup, config: &Config) -> App {
    App::new(config, setup).expect("session")
}

pub fn session(config: Config) -> App {
    opened(setup(), &config)
}

/// A session whose run has no end.
pub fn running() -> App {
    let mut app = session(endless(""));
    sample(&mut app);
    app
}

/// A session whose run is over.
pub fn ended(config: Config) -> App {
    let mut app = session(config);
    end(&mut app);
    app
}

/// A run that ended on its own, at full speed, with the pole down.
pub fn fallen() -> App {
    ended(config("0.5 control-hz 5; 1.5 queue-depth 100"))
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

pub fn press(app: &mut App, keys: &str) {
    for code in chars(keys) {
        app.key(&KeyEvent::new(code, KeyModifiers::NONE));
    }
}

/// The keys of `text`: control characters as terminals send them, `⇱` and `⇲` for Home and End.
pub fn chars(text: &str) -> Vec<KeyCode> {
    let key = |letter| match letter {
        '\n' => KeyCode::Enter,
        '\t' => KeyCode::Tab,
        '\u{1b}' => KeyCode::Esc,
        '\u{7f}' => KeyCode::Backspace,
        '↑' => KeyCode::Up,
        '↓' => KeyCode::Down,
        '⇱' => KeyCode::Home,
        '⇲' => KeyCode::End,
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

/// Presses `keys`, and looks for `parts` on the screen of the default terminal.
#[track_caller]
pub fn then(app: &mut App, keys: &str, parts: &[&str]) {
    press(app, keys);
    sample(app);
    shows(&small(app), parts);
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
struct Decides<F>(F);

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
    let mut app = opened(setup, config);
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
