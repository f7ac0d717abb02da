//! What keys do to a session, and how sessions end.

use std::time::Duration;

use crossterm::event::{KeyCode, KeyEvent, KeyModifiers};
use ratatui::{Terminal, backend::TestBackend};
use ratelab::{ClockKind, Speed, Time};
use ratelab_cart_pole::{Action, CartPole, Observation, policy::Policy};
use ratelab_study::{
    experiment::{Config, Experiment, Summary},
    system::Verdict,
};

use super::*;

/// The knobs that were turned.
fn turned(summary: &Summary) -> Vec<String> {
    let knobs = summary.knobs();
    knobs.iter().map(|timed| timed.knob.to_string()).collect()
}

/// A policy that fails as soon as it is asked.
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
fn keys_turn_the_knobs_of_the_running_graph() {
    let config = Config {
        speed: Speed::times(1.0).expect("speed"),
        end: Time::MAX,
        ..Config::default()
    };
    let (app, _) = typed(config, &chars("[[}>"));
    let summary = app.finish().ended.expect("no fault").summary;
    assert_eq!(
        turned(&summary),
        [
            "rate policy 40",
            "rate policy 30",
            "rate sensor 60",
            "depth /obs 2",
            "depth /action 2",
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
    assert_eq!(turned(&summary), ["rate policy 7.5"]);
}

#[test]
fn a_node_that_fails_or_panics_ends_the_dashboard_with_its_fault() {
    let policies = [
        (Broken(|| Action(f32::NAN)), "must be finite"),
        (Broken(|| panic!("out of ideas")), "panicked: out of ideas"),
    ];
    for (policy, said) in policies {
        for clock in [ClockKind::Virtual, ClockKind::Real] {
            let config = Config {
                clock,
                end: Time::MAX,
                ..Config::default()
            };
            let policy = policy.clone();
            let system = CartPole::with_policy(move |_| Box::new(policy.clone()));
            let setup = SessionSetup {
                system: Arc::new(system),
                ..setup()
            };
            let mut app = App::new(&config, setup).expect("session");
            let mut terminal = Terminal::new(TestBackend::new(80, 24)).expect("terminal");
            let mut nobody = Typist::default();
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
    let app = App::new(&config, setup()).expect("session");
    std::thread::sleep(Duration::from_secs(2));
    app.finish().ended.expect("no fault");
}

#[test]
fn keys_go_on_from_where_the_timed_knobs_led() {
    let config = Config {
        speed: Speed::times(10.0).expect("speed"),
        end: Time::MAX,
        knobs: CartPole::KNOBS
            .parse_list("0 control-hz 20")
            .expect("knobs"),
        ..Config::default()
    };
    let mut app = App::new(&config, setup()).expect("session");
    while app.events(Time::MAX).next().is_none() {
        app.sample().expect("no fault");
    }
    app.sample().expect("no fault");
    press(&mut app, "[");
    let summary = app.finish().ended.expect("no fault").summary;
    assert_eq!(turned(&summary), ["rate policy 20", "rate policy 15"]);
}

#[test]
fn keys_count_even_before_the_graph_has_heard_of_the_last() {
    let config = Config {
        speed: Speed::REAL_TIME,
        end: Time::MAX,
        ..Config::default()
    };
    let mut app = App::new(&config, setup()).expect("session");
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
    assert!(app.desk().quit);
}

#[test]
fn a_pause_is_one_picture_however_long_it_lasts() {
    let config = Config {
        speed: Speed::REAL_TIME,
        end: Time::MAX,
        ..Config::default()
    };
    let mut app = App::new(&config, setup()).expect("session");
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

#[test]
fn the_end_of_the_presets_is_printed() {
    let mut app = ended(Config::default());
    app.key(&KeyEvent::new(KeyCode::Char('<'), KeyModifiers::NONE))
        .expect("obeyed");
    assert!(
        app.desk()
            .notice
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
            app.desk()
                .notice
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
        end: Time::from_nanos(30_000_000_000),
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
        speed: Speed::Unlimited,
        knobs: summary.knobs(),
        ..config
    };
    let again = Experiment::new(setup().system, &headless).expect("experiment");
    let again = again.run().expect("run");
    assert_eq!(figures(&again), figures(&summary));
}

/// All that a run computed, to the bit.
fn figures(summary: &Summary) -> (Verdict, u64, Vec<u64>, Duration, Vec<[u64; 2]>) {
    let state = summary.state.iter().map(|value| value.to_bits());
    let topics = summary.topics.iter();
    (
        summary.verdict,
        summary.steps,
        state.collect(),
        summary.latency.sum(),
        topics.map(|t| [t.published, t.dropped]).collect(),
    )
}

#[test]
fn a_policy_is_swapped_while_the_run_goes_on_and_the_status_says_so() {
    let config = Config {
        end: Time::MAX,
        speed: Speed::REAL_TIME,
        ..Config::default()
    };
    let mut app = App::new(&config, setup()).expect("session");
    let key = KeyEvent::new(KeyCode::Char('p'), KeyModifiers::NONE);
    app.key(&key).expect("no fault");
    let policy = |app: &App| app.screen().map(|shown| shown.frame.settings.join(", "));
    while policy(&app).is_none_or(|policy| policy == "policy scripted") {
        std::thread::sleep(Duration::from_millis(1));
        app.sample().expect("no fault");
    }
    // Those that drop the pole come last.
    assert_eq!(policy(&app).as_deref(), Some("policy lqr"));
    let ended = app.finish().ended.expect("no fault");
    assert!(!ended.summary.verdict.is_lost());
    assert_eq!(turned(&ended.summary), ["send policy lqr"]);
}

#[test]
fn the_smallest_screen_shows_that_the_world_waits_where_it_matters() {
    for (knob, waits) in [
        ("control-hz 40", false),
        ("think-ms 30", true),
        ("link /action delay:10", true),
        ("hang policy 50", true),
    ] {
        let mut app = ended(CartPole::config(knob).expect("a knob"));
        app.sample().expect("no fault");
        let drawn = screen(&app, &PLAIN, 80, 24);
        assert_eq!(drawn.contains("world: waits"), waits, "{knob}: {drawn}");
    }
}

#[test]
fn a_key_starts_again_in_the_other_world_and_back() {
    let mut app = ended(CartPole::config("control-hz 40").expect("a knob"));
    assert!(!screen(&app, &PLAIN, 160, 50).contains("world"), "course");
    press(&mut app, "o");
    app.sample().expect("no fault");
    let drawn = screen(&app, &PLAIN, 160, 50);
    for shown in ["world: own", " world "] {
        assert!(drawn.contains(shown), "{shown} in {drawn}");
    }
    assert_eq!(app.wanted().world.name(), "own");
    assert_eq!(
        app.wanted().setup.rate("policy").map(|hz| hz.get()),
        Some(40.0)
    );
    press(&mut app, "o");
    assert_eq!(app.wanted().world.name(), "course");
}
