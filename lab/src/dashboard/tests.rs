//! The dashboard as a whole: the real loop, injected keys, drawn screens.

use std::{collections::VecDeque, io, sync::atomic::AtomicBool, time::Duration};

use crossterm::event::{Event, KeyCode, KeyEvent, KeyModifiers};
use ratatui::{Terminal, backend::TestBackend};
use ratelab::{
    cartpole::{Action, Observation},
    experiment::{Config, Experiment, Summary, Verdict},
    policy::Policy,
    runtime::{ClockKind, RealClock, Speed, Time},
};

use super::{
    Model, Options,
    app::{App, Pane},
    run,
    session::{Session, Setup},
    terminal::Input,
    view::{self, theme::Theme},
};

const PLAIN: Theme = Theme {
    colour: true,
    ascii: false,
};

fn options() -> Options {
    Options {
        fps: 30,
        theme: PLAIN,
    }
}

/// A run that ended on its own, flat out, with the pole down.
fn fallen() -> App {
    let knobs = "0.5 control-hz 5\n1.5 queue-depth 100";
    let config = Config {
        knobs: ratelab::experiment::parse_knobs(knobs).expect("knobs"),
        ..Config::default()
    };
    ended(config)
}

fn ended(config: Config) -> App {
    let mut app = App::new(&config, Setup::default()).expect("session");
    while !app.ended() {
        app.sample().expect("no fault");
    }
    app.sample().expect("no fault");
    app
}

fn screen(app: &App, theme: &Theme, width: u16, height: u16) -> String {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).expect("terminal");
    terminal
        .draw(|frame| view::render(app.shown().as_ref(), theme, frame))
        .expect("drawn");
    terminal.backend().to_string()
}

/// Types when it is time to, in run time, and quits when the run is over.
struct Typist {
    keys: VecDeque<KeyCode>,
}

impl Input for Typist {
    fn next(&mut self, timeout: Duration) -> io::Result<Option<Event>> {
        std::thread::sleep(timeout);
        let key = self.keys.pop_front();
        Ok(key.map(|code| Event::Key(KeyEvent::new(code, KeyModifiers::NONE))))
    }
}

/// Runs the real loop over `config` with one key per frame, then to the end.
fn typed(config: Config, keys: &[KeyCode]) -> (App, Terminal<TestBackend>) {
    let mut app = App::new(&config, Setup::default()).expect("session");
    let mut terminal = Terminal::new(TestBackend::new(120, 40)).expect("terminal");
    let waits = std::iter::repeat_n(KeyCode::Null, 2);
    let mut keys: VecDeque<KeyCode> = keys.iter().copied().chain(waits).collect();
    keys.push_back(KeyCode::Char('q'));
    let mut typist = Typist { keys };
    let quit = AtomicBool::new(false);
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
    text.chars().map(KeyCode::Char).collect()
}

/// The README's picture. `RATELAB_UPDATE=1 cargo test -p ratelab-lab picture` draws it
/// anew.
#[test]
fn the_picture_in_the_readme_is_the_screen_as_it_is_drawn() {
    let knobs = "4 control-hz 8\n7 control-hz 5";
    let app = ended(Config {
        seed: 1,
        knobs: ratelab::experiment::parse_knobs(knobs).expect("knobs"),
        speed: Speed::FlatOut,
        ..Config::default()
    });
    let mut terminal = Terminal::new(TestBackend::new(120, 40)).expect("terminal");
    let drawn = terminal
        .draw(|frame| view::render(app.shown().as_ref(), &PLAIN, frame))
        .expect("drawn");
    let drawn = super::svg::svg(drawn.buffer);
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/picture.svg");
    if std::env::var_os("RATELAB_UPDATE").is_some() {
        std::fs::write(path, &drawn).expect("written");
    }
    let kept = std::fs::read_to_string(path).expect("lab/picture.svg");
    assert!(
        kept == drawn,
        "lab/picture.svg is out of date: RATELAB_UPDATE=1 cargo test -p ratelab-lab picture"
    );
}

#[test]
fn every_size_shows_the_same_run() {
    let app = fallen();
    insta::assert_snapshot!("full_160x50", screen(&app, &PLAIN, 160, 50));
    insta::assert_snapshot!("compact_80x24", screen(&app, &PLAIN, 80, 24));
    insta::assert_snapshot!("too_small_39x12", screen(&app, &PLAIN, 39, 12));
}

#[test]
fn every_pane_alone_fits_the_smallest_screen() {
    let mut app = fallen();
    for pane in Pane::ALL {
        app.focus = pane;
        let name = format!("{pane:?}_40x12").to_lowercase();
        insta::assert_snapshot!(name, screen(&app, &PLAIN, 40, 12));
    }
}

#[test]
fn no_size_and_no_theme_panics() {
    let mut app = fallen();
    press(&mut app, "m");
    app.help = true;
    let sizes = (0..=60).chain([79, 80, 119, 120, 160, 250]);
    for (width, height) in
        sizes.flat_map(|w| [0, 1, 2, 5, 11, 12, 23, 24, 35, 36, 80].map(|h| (w, h)))
    {
        for (colour, ascii) in [(true, false), (false, true)] {
            let theme = Theme { colour, ascii };
            let mut terminal = Terminal::new(TestBackend::new(width, height)).expect("terminal");
            let drawn = terminal.draw(|frame| view::render(app.shown().as_ref(), &theme, frame));
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
    };
    for pane in Pane::ALL {
        app.focus = pane;
        for (width, height) in [(160, 50), (80, 24), (40, 12)] {
            let mut terminal = Terminal::new(TestBackend::new(width, height)).expect("terminal");
            terminal
                .draw(|frame| view::render(app.shown().as_ref(), &theme, frame))
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
    for topic in [&summary.obs, &summary.action] {
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

#[test]
fn keys_turn_the_knobs_of_the_running_graph() {
    let config = Config {
        speed: Speed::times(1.0).expect("speed"),
        end: Time::MAX,
        ..Config::default()
    };
    let (app, _) = typed(config, &chars("[[}>"));
    let summary = app.finish().ended.expect("no fault").summary;
    let turned: Vec<String> = summary.knobs().iter().map(|k| k.knob.to_string()).collect();
    assert_eq!(
        turned,
        [
            "control-hz 40",
            "control-hz 30",
            "sensor-hz 60",
            "queue-depth 2"
        ]
    );
}

#[test]
fn an_exact_value_can_be_typed() {
    let config = Config {
        speed: Speed::REAL_TIME,
        end: Time::MAX,
        ..Config::default()
    };
    let mut keys = chars(":control-hz 7.5");
    keys.push(KeyCode::Enter);
    let (app, _) = typed(config, &keys);
    let summary = app.finish().ended.expect("no fault").summary;
    let turned: Vec<String> = summary.knobs().iter().map(|k| k.knob.to_string()).collect();
    assert_eq!(turned, ["control-hz 7.5"]);
}

/// A brain that fails as soon as it is asked.
#[derive(Clone)]
struct Broken(fn() -> Action);

impl Policy for Broken {
    fn name(&self) -> &str {
        "broken"
    }

    fn act(&mut self, _: &Observation) -> Action {
        (self.0)()
    }
}

#[test]
fn a_node_that_fails_or_panics_ends_the_dashboard_with_its_fault() {
    let brains = [
        (Broken(|| Action(f32::NAN)), "must be finite"),
        (Broken(|| panic!("out of ideas")), "panicked: out of ideas"),
    ];
    for (brain, said) in brains {
        for clock in [ClockKind::Virtual, ClockKind::Real] {
            let config = Config {
                clock,
                end: Time::MAX,
                ..Config::default()
            };
            let brain = Box::new(brain.clone());
            let experiment = Experiment::with_policy(&config, brain).expect("experiment");
            let mut app = App::watching(Session::of(experiment, &config, None), Setup::default());
            let mut terminal = Terminal::new(TestBackend::new(80, 24)).expect("terminal");
            let mut nobody = Typist {
                keys: VecDeque::new(),
            };
            let quit = AtomicBool::new(false);
            let end = run(&mut terminal, &mut nobody, &mut app, &options(), &quit);
            let fault = end.expect_err("a fault").to_string();
            assert!(
                fault.contains("\"policy\"") && fault.contains(said),
                "{fault}"
            );
            assert_eq!(fault.lines().count(), 1);
        }
    }
}

#[test]
fn a_session_that_nobody_watched_for_long_still_ends_at_once() {
    // Flat out, the taps are full long before this is over.
    let config = Config {
        end: Time::MAX,
        ..Config::default()
    };
    let app = App::new(&config, Setup::default()).expect("session");
    std::thread::sleep(Duration::from_secs(2));
    app.finish().ended.expect("no fault");
}

#[test]
fn keys_go_on_from_where_the_timed_knobs_led() {
    let config = Config {
        speed: Speed::times(10.0).expect("speed"),
        end: Time::MAX,
        knobs: ratelab::experiment::parse_knobs("0 control-hz 20").expect("knobs"),
        ..Config::default()
    };
    let mut app = App::new(&config, Setup::default()).expect("session");
    while app.events(Time::MAX).next().is_none() {
        app.sample().expect("no fault");
    }
    app.sample().expect("no fault");
    press(&mut app, "[");
    let summary = app.finish().ended.expect("no fault").summary;
    let turned: Vec<String> = summary.knobs().iter().map(|k| k.knob.to_string()).collect();
    assert_eq!(turned, ["control-hz 20", "control-hz 15"]);
}

#[test]
fn keys_count_even_before_the_graph_has_heard_of_the_last() {
    let config = Config {
        speed: Speed::REAL_TIME,
        end: Time::MAX,
        ..Config::default()
    };
    let mut app = App::new(&config, Setup::default()).expect("session");
    press(&mut app, "  cccc");
    let summary = app.finish().ended.expect("no fault").summary;
    let told: Vec<String> = summary.events.iter().map(|e| e.to_string()).collect();
    let count = |what: &str| told.iter().filter(|event| event.contains(what)).count();
    assert_eq!(
        (count("pause"), count("resume"), count("refused")),
        (1, 1, 0),
        "{told:?}"
    );
    assert_eq!(
        (count("real clock"), count("virtual clock")),
        (2, 2),
        "{told:?}"
    );
}

#[test]
fn control_c_leaves_while_a_value_is_being_typed() {
    let mut app = ended(Config::default());
    press(&mut app, ":con");
    let key = KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL);
    app.key(&key).expect("obeyed");
    assert!(app.quit);
}

#[test]
fn a_pause_is_one_picture_however_long_it_lasts() {
    let config = Config {
        speed: Speed::REAL_TIME,
        end: Time::MAX,
        ..Config::default()
    };
    let mut app = App::new(&config, Setup::default()).expect("session");
    press(&mut app, " ");
    let begun = std::time::Instant::now();
    while begun.elapsed() < Duration::from_millis(2500) {
        app.sample().expect("no fault");
        std::thread::sleep(Duration::from_millis(10));
    }
    press(&mut app, ",");
    let kept = app.looking_back().map_or(1, |(_, kept)| kept);
    assert!(kept <= 4, "{kept} pictures of a graph that stood still");
    app.finish().ended.expect("no fault");
}

fn press(app: &mut App, keys: &str) {
    for key in chars(keys) {
        app.key(&KeyEvent::new(key, KeyModifiers::NONE))
            .expect("obeyed");
    }
}

#[test]
fn the_end_of_a_ladder_says_so() {
    let mut app = ended(Config::default());
    app.key(&KeyEvent::new(KeyCode::Char('<'), KeyModifiers::NONE))
        .expect("obeyed");
    assert!(
        app.notice
            .as_deref()
            .is_some_and(|notice| notice.contains("lowest, 1"))
    );
}

#[test]
fn the_real_clock_says_that_it_has_no_speed_and_cannot_step() {
    let config = Config {
        clock: ClockKind::Real,
        end: Time::MAX,
        ..Config::default()
    };
    let (mut app, _) = typed(config, &[]);
    for (key, said) in [('+', "no speed"), ('.', "cannot step")] {
        app.key(&KeyEvent::new(KeyCode::Char(key), KeyModifiers::NONE))
            .expect("obeyed");
        assert!(
            app.notice
                .as_deref()
                .is_some_and(|notice| notice.contains(said)),
            "{key}"
        );
    }
    app.finish().ended.expect("no fault");
}

#[test]
fn a_session_with_live_keys_is_the_headless_run_with_its_knobs() {
    let config = Config {
        speed: Speed::times(20.0).expect("speed"),
        end: Time::from_nanos(6_000_000_000),
        ..Config::default()
    };
    let (mut app, _) = typed(config.clone(), &chars("[[ . .. >[[[[  ]]"));
    while !app.ended() {
        app.sample().expect("no fault");
    }
    app.sample().expect("no fault");
    let summary = app.finish().ended.expect("no fault").summary;
    assert!(
        summary.knobs().len() >= 8,
        "the keys came too late to count"
    );

    let headless = Config {
        speed: Speed::FlatOut,
        knobs: summary.knobs(),
        ..config
    };
    let again = Experiment::new(&headless).expect("experiment");
    let again = again.run(&mut RealClock::default()).expect("run");
    assert_eq!(figures(&again), figures(&summary));
}

/// All that a run computed, to the bit.
fn figures(summary: &Summary) -> (Verdict, u64, u64, Duration, [u64; 4]) {
    (
        summary.verdict,
        summary.steps,
        summary.final_pole_angle.to_bits(),
        summary.latency.sum(),
        [
            summary.obs.published,
            summary.obs.dropped,
            summary.action.published,
            summary.action.dropped,
        ],
    )
}

#[test]
fn a_brain_is_swapped_while_the_run_goes_on_and_the_status_says_so() {
    let config = Config {
        end: Time::MAX,
        speed: Speed::REAL_TIME,
        ..Config::default()
    };
    let mut app = App::new(&config, Setup::default()).expect("session");
    let key = KeyEvent::new(KeyCode::Char('p'), KeyModifiers::NONE);
    app.key(&key).expect("no fault");
    let policy = |app: &App| app.shown().map(|shown| shown.picture.policy.clone());
    while policy(&app).is_none_or(|policy| policy == "scripted") {
        std::thread::sleep(Duration::from_millis(1));
        app.sample().expect("no fault");
    }
    // Those that drop the pole come last.
    assert_eq!(policy(&app).as_deref(), Some("lqr"));
    let ended = app.finish().ended.expect("no fault");
    assert!(ended.summary.verdict.balanced());
    let turned: Vec<String> = ended
        .summary
        .knobs()
        .iter()
        .map(|k| k.knob.to_string())
        .collect();
    assert_eq!(turned, ["policy lqr"]);
}

/// Opens the map and waits until all of it is made.
fn with_map() -> App {
    let mut app = ended(Config {
        control_hz: ratelab::runtime::Hz::new(7.0).expect("rate"),
        ..Config::default()
    });
    press(&mut app, "m");
    while !screen(&app, &PLAIN, 120, 36).contains("3000 runs of 10 s") {
        app.sample().expect("no fault");
        std::thread::sleep(Duration::from_millis(5));
    }
    app
}

#[test]
fn the_cliff_map_lies_over_the_panes() {
    let app = with_map();
    insta::assert_snapshot!("map_120x36", screen(&app, &PLAIN, 120, 36));
    insta::assert_snapshot!("map_80x24", screen(&app, &PLAIN, 80, 24));
    let poor = Theme {
        colour: false,
        ascii: true,
    };
    insta::assert_snapshot!("map_40x12", screen(&app, &poor, 40, 12));
}

#[test]
fn the_map_is_kept_until_its_conditions_change() {
    let mut app = with_map();
    press(&mut app, "m");
    assert!(!screen(&app, &PLAIN, 120, 36).contains("cliff map"));
    press(&mut app, "m");
    assert!(screen(&app, &PLAIN, 120, 36).contains("3000 runs of 10 s"));
    // Keys of the lab go on to work under it.
    press(&mut app, ">");
    app.sample().expect("no fault");
    assert!(screen(&app, &PLAIN, 120, 36).contains("depth 2"));
    assert!(screen(&app, &PLAIN, 120, 36).contains("of 3000 runs"));
}
