//! The dashboard as a whole: the real loop, injected keys, drawn screens.

mod adders;
mod again;
mod ages;
mod branch;
mod faults;
mod files;
mod order;
mod panel;
mod prompt;
mod rescue;
pub mod sample;
mod sessions;
mod stuck;
mod systems;
pub mod testing;
mod tour;

use std::{
    collections::VecDeque,
    io,
    path::Path,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use crossterm::event::{Event, KeyCode, KeyEvent, KeyModifiers};
use ratatui::{Terminal, backend::TestBackend, buffer::Buffer, layout::Size};
use ratelab::{ClockKind, Speed, Time};
use ratelab_cart_pole::CartPole;
use ratelab_study::{experiment::Config, system::WorldKind};

use super::{
    Model, Options,
    app::App,
    focus::Pane,
    frame::Standing,
    run,
    session::SessionSetup,
    terminal::Input,
    view::{self},
};
use crate::{
    recording::Recording,
    theme::{Look, Theme},
};

const PLAIN: Theme = Theme {
    colour: true,
    ascii: false,
    look: Look::Dark,
};

/// The cart-pole, nothing recorded.
fn setup() -> SessionSetup {
    SessionSetup::new(Arc::new(CartPole::default()), true)
}

/// A session whose run has no end.
fn running() -> App {
    let config = Config {
        speed: Speed::REAL_TIME,
        end: Time::MAX,
        ..Config::default()
    };
    let mut app = App::new(&config, setup()).expect("session");
    app.sample().expect("no fault");
    app
}

fn options() -> Options {
    Options {
        fps: 30,
        theme: PLAIN,
        ask_background: false,
    }
}

/// A run that ended on its own, flat out, with the pole down.
fn fallen() -> App {
    let knobs = "0.5 control-hz 5\n1.5 queue-depth 100";
    let config = Config {
        knobs: CartPole::KNOBS.parse_list(knobs).expect("knobs"),
        ..Config::default()
    };
    ended(config)
}

fn ended(config: Config) -> App {
    let mut app = App::new(&config, setup()).expect("session");
    while !app.ended() {
        app.sample().expect("no fault");
    }
    app.sample().expect("no fault");
    app
}

fn screen(app: &App, theme: &Theme, width: u16, height: u16) -> String {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).expect("terminal");
    terminal
        .draw(|frame| view::render(app.screen().as_ref(), theme, frame))
        .expect("drawn");
    terminal.backend().to_string()
}

/// Types a key per frame, and notes when there are no more.
#[derive(Default)]
struct Typist {
    keys: VecDeque<KeyCode>,
    done: Arc<AtomicBool>,
}

impl Input for Typist {
    fn next(&mut self, timeout: Duration) -> io::Result<Option<Event>> {
        std::thread::sleep(timeout);
        let key = self.keys.pop_front();
        self.done.store(self.keys.is_empty(), Ordering::Relaxed);
        Ok(key.map(|code| Event::Key(KeyEvent::new(code, KeyModifiers::NONE))))
    }
}

/// Runs the real loop over `config` with one key per frame; the session goes on.
fn typed(config: Config, keys: &[KeyCode]) -> (App, Terminal<TestBackend>) {
    let mut app = App::new(&config, setup()).expect("session");
    let mut terminal = Terminal::new(TestBackend::new(120, 40)).expect("terminal");
    let waits = std::iter::repeat_n(KeyCode::Null, 2);
    let mut typist = Typist {
        keys: keys.iter().copied().chain(waits).collect(),
        ..Typist::default()
    };
    let quit = typist.done.clone();
    run_infallible(&mut terminal, &mut typist, &mut app, &quit);
    (app, terminal)
}

fn run_infallible(
    terminal: &mut Terminal<TestBackend>,
    typist: &mut Typist,
    app: &mut App,
    quit: &AtomicBool,
) {
    run(terminal, typist, app, &options(), quit).expect("the loop ended in order");
}

fn chars(text: &str) -> Vec<KeyCode> {
    let key = |letter| match letter {
        '\n' => KeyCode::Enter,
        letter => KeyCode::Char(letter),
    };
    text.chars().map(key).collect()
}

/// The README's picture. `RATELAB_UPDATE=1 cargo test manual` draws it
/// anew.
/// The headline of the newest frame, and its reasons.
fn verdict(app: &App) -> String {
    let screen = app.screen().expect("a frame");
    let verdict = &screen.frame.verdict;
    format!("{} {}", verdict.headline, verdict.why.join(" "))
}

#[test]
fn the_picture_in_the_manual_is_the_screen_as_it_is_drawn() {
    let knobs = "4 control-hz 8\n7 control-hz 5";
    let config = Config {
        seed: 1,
        knobs: CartPole::KNOBS.parse_list(knobs).expect("knobs"),
        speed: Speed::Unlimited,
        ..Config::default()
    };
    let size = Size::new(120, 40);
    let drawn = super::picture::of_run(&config, setup(), size, &PLAIN).expect("a picture");
    is_kept("picture.svg", &drawn);
}

/// The moving picture of the README.
#[test]
fn the_moving_picture_in_the_manual_is_the_recording_as_it_is_drawn() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../recordings/fall-5hz.rrd");
    let recording = Arc::new(Recording::read(file.as_ref()).expect("a recording"));
    let (size, span) = (Size::new(80, 24), (recording.until, 0.2));
    let drawn = super::picture::moving(recording, &setup().system, span, size, &PLAIN);
    let drawn = drawn.expect("a picture");
    // The title of the graph is in the file once, the run time for each frame.
    assert_eq!(drawn.matches("y=\"123\">g<").count(), 1);
    assert!(drawn.matches("@keyframes").count() > 30);
    assert!(drawn.contains("prefers-reduced-motion"));
    is_kept("moving.svg", &drawn);
}

/// Compares a drawing with the file of the manual, or updates that.
fn is_kept(name: &str, drawn: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
    if std::env::var_os("RATELAB_UPDATE").is_some() {
        std::fs::write(&path, drawn).expect("written");
    }
    let kept = std::fs::read_to_string(&path).expect(name);
    assert!(
        kept == drawn,
        "lab/{name} is out of date: RATELAB_UPDATE=1 cargo test manual"
    );
}

#[test]
fn every_size_shows_the_same_run() {
    let app = fallen();
    insta::assert_snapshot!("full_160x50", screen(&app, &PLAIN, 160, 50));
    insta::assert_snapshot!("compact_80x24", screen(&app, &PLAIN, 80, 24));
    insta::assert_snapshot!("too_small_39x12", screen(&app, &PLAIN, 39, 12));
}

/// A healthy run, one that is warned of, and one that fell.
#[test]
fn the_default_terminal_shows_angle_age_and_cause_uncut() {
    for (knobs, [verdict, also]) in [
        ("0 control-hz 50", ["BALANCED", "this push is"]),
        (
            "0 control-hz 5",
            ["] raises", "readings were dropped, each for a newer one"],
        ),
        (
            "0 sensor-hz 5",
            ["it looks 5 times a second", "this push is"],
        ),
        (
            "0 link /action delay:100",
            [":link /action none mends it", "this push is"],
        ),
    ] {
        let app = ended(Config {
            knobs: CartPole::KNOBS.parse_list(knobs).expect("knobs"),
            ..Config::default()
        });
        let drawn = screen(&app, &PLAIN, 80, 24);
        for part in ["pole angle", "age of the push", " of 90", verdict, also] {
            assert!(drawn.contains(part), "{knobs}: no {part:?} in\n{drawn}");
        }
        assert!(!drawn.contains('…'), "{knobs}:\n{drawn}");
    }
}

#[test]
fn the_own_world_keeps_names_words_and_seed_in_the_default_terminal() {
    let app = ended(Config {
        world: WorldKind::OWN,
        seed: 7,
        ..Config::default()
    });
    let drawn = screen(&app, &PLAIN, 80, 24);
    for part in ["seed 7", "─/state►", " /obs ", " /action ", "0 dropped"] {
        assert!(drawn.contains(part), "no {part:?} in\n{drawn}");
    }
}

#[test]
fn the_prompt_lists_every_knob_in_the_default_terminal() {
    let mut app = fallen();
    press(&mut app, ":");
    let drawn = screen(&app, &PLAIN, 80, 24);
    for kind in ratelab::KnobKind::ALL {
        let usage = kind.usage().split(' ');
        for word in usage {
            assert!(drawn.contains(word), "no {word:?} in\n{drawn}");
        }
    }
}

#[test]
fn the_dashes_of_the_last_run_are_named_once_there_is_one() {
    let mut app = fallen();
    assert!(!screen(&app, &PLAIN, 80, 24).contains("last run"));
    press(&mut app, "r");
    while !app.ended() {
        app.sample().expect("no fault");
        std::thread::yield_now();
    }
    app.sample().expect("no fault");
    let drawn = screen(&app, &PLAIN, 80, 24);
    assert!(
        drawn.contains("age of the push (ms)  ╌╌ last run"),
        "{drawn}"
    );
}

/// Ways to lose the pole with long causes, and a healthy run.
const LONG: [&str; 8] = [
    "0 control-hz 50",
    "0 control-hz 5\n0 queue-depth 100",
    "0 sensor-hz 5\n0 control-hz 5",
    "0 link /obs delay:40,loss:0.9",
    "0 takes policy 60..110",
    "0 control-hz 45\n0 read /obs oldest\n0 depth /obs 10",
    "0.3 crash policy",
    "0 policy random",
];

#[test]
fn nothing_is_cut_at_the_usual_sizes() {
    for knobs in LONG {
        for world in [WorldKind::Course, WorldKind::OWN] {
            let mut app = ended(Config {
                knobs: CartPole::KNOBS.parse_list(knobs).expect("knobs"),
                world,
                ..Config::default()
            });
            for pane in Pane::ALL {
                app.desk_mut().panes.focus = pane;
                for overlay in ["", "i", "?", "G"] {
                    press(&mut app, overlay);
                    for (width, height) in [(160, 50), (120, 35), (100, 30), (80, 24)] {
                        let drawn = screen(&app, &PLAIN, width, height);
                        // A table counts the rows that a zoom shows.
                        let mut cut = drawn.lines().filter(|line| line.contains('…'));
                        let whole = cut.all(|line| line.contains("more") && pane == Pane::Figures);
                        assert!(whole, "{knobs} {pane:?} {overlay}:\n{drawn}");
                    }
                    press(&mut app, overlay);
                }
            }
        }
    }
}

#[test]
fn the_default_terminal_names_two_causes_with_their_keys() {
    let knobs = "0 sensor-hz 5\n0 control-hz 5";
    let app = ended(Config {
        knobs: CartPole::KNOBS.parse_list(knobs).expect("knobs"),
        ..Config::default()
    });
    let drawn = screen(&app, &PLAIN, 80, 24);
    for part in [
        "FELL at",
        "} raises sensor-hz",
        "] raises control-hz",
        "this loop bears 90",
    ] {
        assert!(drawn.contains(part), "no {part:?} in\n{drawn}");
    }
}

#[test]
fn the_events_blame_the_slow_node_and_its_setting() {
    let fallen = |knobs: &str, width, height| {
        let knobs = CartPole::KNOBS.parse_list(knobs).expect("knobs");
        let config = Config {
            knobs,
            ..Config::default()
        };
        screen(&ended(config), &PLAIN, width, height)
    };
    let sensor = fallen("0 sensor-hz 5", 80, 24);
    let cause = "the age arose at the sensor: it looks 5 times a second. } raises sensor-hz";
    assert!(sensor.contains(cause), "{sensor}");
    let sensor = fallen("0 sensor-hz 5", 160, 50);
    assert!(
        !sensor.contains("control-hz") && !sensor.contains("queue"),
        "{sensor}"
    );
    let policy = fallen("0 control-hz 5", 80, 24);
    let cause = "the age arose on /action: the policy decides every 200 ms. ] raises control-hz";
    assert!(policy.contains(cause), "{policy}");
    assert!(policy.contains("age  96 ms of 90"), "{policy}");
    let policy = fallen("0 control-hz 5", 160, 50);
    assert!(policy.contains("37 readings were dropped"), "{policy}");
}

#[test]
fn every_pane_alone_fits_the_smallest_screen() {
    let mut app = fallen();
    for pane in Pane::ALL {
        app.desk_mut().panes.focus = pane;
        let name = format!("{pane:?}_40x12").to_lowercase();
        insta::assert_snapshot!(name, screen(&app, &PLAIN, 40, 12));
    }
}

#[test]
fn no_size_and_no_theme_panics() {
    let mut app = fallen();
    press(&mut app, "m");
    app.desk_mut().panes.overlay = Some(super::overlay::Overlay::of(
        super::overlay::OverlayContent::Keys,
    ));
    let sizes = (0..=60).chain([79, 80, 119, 120, 160, 250]);
    for (width, height) in
        sizes.flat_map(|w| [0, 1, 2, 5, 11, 12, 23, 24, 35, 36, 80].map(|h| (w, h)))
    {
        for (colour, ascii) in [(true, false), (false, true)] {
            let theme = Theme {
                colour,
                ascii,
                look: Look::Dark,
            };
            let mut terminal = Terminal::new(TestBackend::new(width, height)).expect("terminal");
            let drawn = terminal.draw(|frame| view::render(app.screen().as_ref(), &theme, frame));
            assert!(drawn.is_ok(), "{width}x{height}");
        }
    }
}

#[test]
fn ascii_is_ascii_and_no_colour_sets_none() {
    let mut app = fallen();
    let theme = Theme {
        colour: false,
        ascii: true,
        look: Look::Dark,
    };
    for pane in Pane::ALL {
        app.desk_mut().panes.focus = pane;
        for (width, height) in [(160, 50), (80, 24), (40, 12)] {
            let mut terminal = Terminal::new(TestBackend::new(width, height)).expect("terminal");
            terminal
                .draw(|frame| view::render(app.screen().as_ref(), &theme, frame))
                .expect("drawn");
            for cell in terminal.backend().buffer().content() {
                assert!(cell.symbol().is_ascii(), "{:?} in {pane:?}", cell.symbol());
                assert_eq!(cell.fg, ratatui::style::Color::Reset);
                assert_eq!(cell.bg, ratatui::style::Color::Reset);
            }
        }
    }
}

#[test]
fn the_numbers_drawn_are_those_of_the_summary() {
    let app = fallen();
    let drawn = screen(&app, &PLAIN, 160, 50);
    let summary = app.finish().ended.expect("no fault").summary;
    assert!(drawn.contains(&summary.verdict.to_string()));
    let row = |topic: &str| {
        let mut lines = drawn.lines();
        // The table's rows begin with the name, inside of the pane's border.
        let row = lines
            .find(|line| line.split_whitespace().nth(1) == Some(topic) && line.contains(" 100 "));
        row.unwrap_or_else(|| panic!("{topic} has no row in\n{drawn}"))
            .to_owned()
    };
    for topic in [summary.topic("/obs"), summary.topic("/action")] {
        let row = row(&topic.name);
        for figure in [topic.published, topic.dropped] {
            let words = row.split_whitespace();
            assert!(
                words.into_iter().any(|word| word == figure.to_string()),
                "{figure} in {row}"
            );
        }
    }
}

fn press(app: &mut App, keys: &str) {
    for key in chars(keys) {
        app.key(&KeyEvent::new(key, KeyModifiers::NONE))
            .expect("obeyed");
    }
}

/// Opens the map and waits until all of it is made.
fn with_map() -> App {
    let mut app = ended(CartPole::config("control-hz 7").expect("a knob"));
    press(&mut app, "m");
    while !screen(&app, &PLAIN, 120, 36).contains("3000 runs of 10 s") {
        app.sample().expect("no fault");
        // To draw takes a core as long as to run.
        std::thread::sleep(Duration::from_millis(50));
    }
    app
}

#[test]
fn the_cliff_map_lies_over_the_panes_and_is_kept_until_its_conditions_change() {
    let mut app = with_map();
    insta::assert_snapshot!("map_120x36", screen(&app, &PLAIN, 120, 36));
    insta::assert_snapshot!("map_80x24", screen(&app, &PLAIN, 80, 24));
    let poor = Theme {
        colour: false,
        ascii: true,
        look: Look::Dark,
    };
    insta::assert_snapshot!("map_40x12", screen(&app, &poor, 40, 12));
    press(&mut app, "m");
    assert!(!screen(&app, &PLAIN, 120, 36).contains("cliff map"));
    press(&mut app, "m");
    assert!(screen(&app, &PLAIN, 120, 36).contains("3000 runs of 10 s"));
    // It begins at the rate in force again, and gets a column for it.
    press(&mut app, "m]]]]m");
    assert!(screen(&app, &PLAIN, 120, 36).contains("12 Hz, seed 0"));
    press(&mut app, "m]]]]]m");
    assert!(screen(&app, &PLAIN, 120, 36).contains("40 Hz, seed 0"));
    // Keys of the lab go on to work under it.
    press(&mut app, ">");
    app.sample().expect("no fault");
    assert!(screen(&app, &PLAIN, 120, 36).contains("queue-depth 2"));
    assert!(screen(&app, &PLAIN, 120, 36).contains("of 3100 runs"));
}

/// The rate of `node` that the next session begins with, if it is set.
fn rate(app: &App, node: &str) -> Option<f64> {
    app.wanted().setup.rate(node).map(ratelab::Hz::get)
}

/// All that a run over the real or the virtual clock shows until it is over, or for
/// some frames; with what the terminal was told of each cell.
fn frames(config: Config, mut each: impl FnMut(&App, &Buffer)) {
    let mut app = App::new(&config, setup()).expect("session");
    let mut terminal = Terminal::new(TestBackend::new(160, 50)).expect("terminal");
    loop {
        let over = app.ended();
        app.sample().expect("no fault");
        let drawn = terminal.draw(|frame| view::render(app.screen().as_ref(), &PLAIN, frame));
        each(&app, drawn.expect("drawn").buffer);
        if over {
            return;
        }
    }
}

fn warned(buf: &Buffer) -> String {
    view::testing::styled(buf, PLAIN.alarm_line())
}

#[test]
fn a_healthy_run_shows_no_warning_whatever_it_drops() {
    let virtual_clock = Config {
        speed: Speed::times(20.0).expect("speed"),
        ..Config::default()
    };
    let real_clock = Config {
        clock: ClockKind::Real,
        end: Time::from_nanos(700_000_000),
        ..Config::default()
    };
    let dropping = CartPole::config("sensor-hz 100").expect("knobs");
    for config in [virtual_clock, real_clock, dropping] {
        frames(config, |_, buf| assert_eq!(warned(buf), ""));
    }
}

#[test]
fn a_run_that_falls_is_warned_of_before_it_falls() {
    for knobs in [
        "control-hz 5",
        "sensor-hz 5",
        "control-hz 5, queue-depth 100",
    ] {
        let config = Config {
            speed: Speed::REAL_TIME,
            ..CartPole::config(knobs).expect("knobs")
        };
        let mut warned_at = None;
        frames(config, |app, buf| {
            let frame = app.screen().map(|shown| shown.frame.clone());
            if frame.is_some_and(|frame| frame.verdict.standing == Standing::Warned)
                && !warned(buf).is_empty()
            {
                warned_at = warned_at.or(app.screen().map(|shown| shown.frame.now));
            }
        });
        assert!(warned_at.is_some(), "{knobs}");
    }
}
