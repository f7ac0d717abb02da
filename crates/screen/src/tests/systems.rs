//! Systems other than the cart-pole.

use ratelab::{Flow, Tick};
use ratelab_metrics::fields;
use ratelab_system::{
    About, BuildError, Builder, Judge, Picture, RobotInfo, Setup as RunSetup, Shape, Signal,
    SignalValue, Style, System, Verdict, VerdictKind,
};

use super::{adders::Adders, *};
use crate::asked::Asked;

#[derive(Clone, Copy)]
struct Flight {
    height: f64,
    thrust: f64,
}
fields!(Flight {
    height: "height (m)",
    thrust: "thrust"
});

/// A drone that sinks, whatever its pilot does.
struct Drone;

impl Drone {
    const CRASHED: VerdictKind = VerdictKind::lost("crashed", "CRASHED at {at}");
    const FLEW: VerdictKind = VerdictKind::held("hovering", "FLEW for {at}");
}

impl System for Drone {
    fn name(&self) -> &str {
        "drone"
    }

    fn build(&self, builder: &mut Builder<'_>) -> Result<(), BuildError> {
        let thrust = builder.internal_topic::<f64>("/thrust");
        let flight = builder.topic::<Flight>("/flight");
        let (thrusts, flights) = (thrust.clone(), flight.clone());
        builder.node("pilot", 20.0, 0, move |wiring| {
            let (thrust, mut flight) = (wiring.publisher(&thrusts), wiring.subscription(&flights));
            move |tick: &mut Tick| {
                tick.read(&mut flight);
                tick.publish(&thrust, 0.5);
            }
        })?;
        builder.node("rotors", 50.0, 1, move |wiring| {
            let (mut thrust, flight) = (wiring.subscription(&thrust), wiring.publisher(&flight));
            let mut height = 2.0;
            move |tick: &mut Tick| {
                let asked = tick.read(&mut thrust);
                height -= 0.01;
                let thrust = asked.map_or(0.0, |message| message.data);
                let state = Flight { height, thrust };
                tick.publish_new(&flight, state);
                if height > 0.0 {
                    Flow::Continue
                } else {
                    Flow::End
                }
            }
        })
    }

    fn signals(&self) -> Vec<Signal> {
        vec![Signal {
            name: "height".into(),
            unit: "m".into(),
            topic: "/flight".into(),
            value: SignalValue::new(|row| row[0]),
            limits: Some([0.0, 4.0]),
            range: [0.0, 2.5],
        }]
    }

    fn about(&self) -> About<'_> {
        About {
            state: Some("/flight"),
            ..About::default()
        }
    }

    fn judge(&self) -> &dyn Judge {
        self
    }

    fn robot(&self) -> &dyn RobotInfo {
        self
    }
}

impl Judge for Drone {
    fn verdict(&self, _: &ratelab::ClockExit, at: Time, state: Option<&[f64]>) -> Verdict {
        match state {
            Some([height, _]) if *height <= 0.0 => Verdict::new(Self::CRASHED, at),
            _ => Verdict::new(Self::FLEW, at),
        }
    }

    fn verdicts(&self) -> Vec<VerdictKind> {
        vec![Self::FLEW, Self::CRASHED]
    }
}

impl RobotInfo for Drone {
    fn picture(&self, state: &[f64]) -> Option<Picture> {
        let &[height, _] = state else {
            return None;
        };
        let body = Shape::Box {
            centre: [0.0, height],
            half: [0.4, 0.1],
            angle: 0.0,
        };
        let (from, to) = ([-2.0, 0.0], [2.0, 0.0]);
        let goal = Shape::Circle {
            centre: [1.5, 2.0],
            radius: 0.3,
        };
        let label = Shape::Label {
            at: [0.0, 0.0],
            text: "ground".to_owned(),
        };
        Some(Picture {
            shapes: vec![
                (Style::Scenery, Shape::Segment { from, to }),
                (Style::Limit, goal),
                (Style::Subject, body),
                (Style::Scenery, label),
            ],
            view: [-2.0, -0.2, 2.0, 2.5],
            focus: [0.0, height],
            captions: vec![format!("height {height:+.2} m")],
        })
    }
}

/// A counter and its reader: no plant, no signal, no aliases.
fn counter() -> Arc<dyn System> {
    graph(
        r#"
        name = "counter"
        [node]
        counter = { rate = 10, publishes = ["/count"] }
        reader = { rate = 2, reads = ["/count"] }
        "#,
    )
}

fn lab(system: Arc<dyn System>, config: &Config) -> App {
    let mut app = opened(SessionSetup::new(system, None), config);
    sample(&mut app);
    app
}

/// A run of `system` that ended.
fn run_of(system: Arc<dyn System>) -> App {
    let mut app = lab(system, &Config::default());
    end(&mut app);
    app
}

/// A run of `system` that goes on.
fn live(system: Arc<dyn System>) -> App {
    lab(system, &endless(""))
}

#[test]
fn a_system_without_a_plant_has_no_pane_of_it_and_the_others_take_its_room() {
    let app = run_of(counter());
    insta::assert_snapshot!("counter_80x24", small(&app));
    let drawn = large(&app);
    for absent in ["2 plant", "3 ", "sense→act", "exercises"] {
        assert!(!drawn.contains(absent), "{absent} in {drawn}");
    }
}

#[test]
fn a_run_without_a_latency_goes_on_however_many_ticks_it_makes() {
    let mut app = lab(counter(), &config("until ever"));
    until(&mut app, |app| ticks(app) > 100_000);
    leave(app);
}

#[test]
fn a_pane_that_is_not_there_is_never_in_focus() {
    let mut app = run_of(counter());
    press(&mut app, "2");
    assert_eq!(app.shown.panes.focus, Pane::Graph);
    assert!(app.notice.is_some());
    for pane in [Pane::Figures, Pane::Events, Pane::Graph] {
        press(&mut app, "\t");
        assert_eq!(app.shown.panes.focus, pane);
    }
}

#[test]
fn a_system_of_ones_own_is_drawn_with_its_signal_and_its_verdict() {
    let app = run_of(Arc::new(Drone));
    insta::assert_snapshot!("drone_100x30", screen(&app, 100, 30));
}

#[test]
fn every_size_shows_every_system() {
    for (name, app) in [
        ("drone", run_of(Arc::new(Drone))),
        ("counter", run_of(counter())),
    ] {
        for (width, height) in [(40, 12), (80, 24), (120, 36), (160, 50), (250, 80)] {
            shows(&screen(&app, width, height), &[name, "1 graph"]);
        }
    }
}

#[test]
fn rate_and_depth_keys_turn_what_is_marked() {
    let mut app = live(Arc::new(Drone));
    // The node in the middle of most, and all topics that are read.
    assert_eq!(app.shown.knob_focus.node, "pilot");
    assert_eq!(app.shown.knob_focus.topics, ["/thrust", "/flight"]);
    press(&mut app, "[>");
    let turned = ["rate pilot 15", "depth /thrust 2", "depth /flight 2"];
    assert_eq!(set(&app), turned);
    press(&mut app, "↓t]>");
    assert_eq!(app.shown.knob_focus.topics, ["/thrust"]);
    let turned = [
        "rate pilot 15",
        "depth /thrust 5",
        "depth /flight 2",
        "rate rotors 60",
    ];
    assert_eq!(set(&app), turned);
    let drawn = large(&app);
    shows(&drawn, &["▸rotors", "▸/thrust"]);
    assert!(!drawn.contains("▸pilot"), "{drawn}");
    // Once round all topics, those of the beginning are marked.
    press(&mut app, "T");
    assert_eq!(app.shown.knob_focus.topics.len(), 2);
}

#[test]
fn the_map_of_a_system_without_aliases_is_over_the_marked_node() {
    let mut app = live(Arc::new(Drone));
    for place in ["20 Hz, seed 0", "50 Hz, seed 0"] {
        press(&mut app, "m");
        sample(&mut app);
        shows(&screen(&app, 120, 40), &["cliff map", place]);
        press(&mut app, "m↓");
    }
    leave(app);
}

#[test]
fn keys_without_a_meaning_here_say_so_and_are_in_no_help() {
    for keys in ["e", "b", "p", "{"] {
        let mut app = live(counter());
        press(&mut app, keys);
        shows(said(&app), &["this system"]);
        press(&mut app, "?");
        let help = large(&app);
        assert!(!help.contains(&format!("│ {keys} ")), "{keys} in {help}");
    }
}

#[test]
fn a_system_without_a_world_of_its_own_stays_in_the_one_it_has() {
    let mut app = run_of(counter());
    press(&mut app, "o");
    shows(said(&app), &["no world of its own"]);
    assert!(app.ended(), "it began again");
    press(&mut app, "?");
    assert!(!large(&app).contains("other world"));
}

#[test]
fn a_write_from_outside_of_the_graph_is_noticed_while_the_run_goes_on_and_once() {
    let adders = Arc::new(Adders::default());
    let mut app = lab(adders.clone(), &endless("real"));
    until(&mut app, |app| ticks(app) > 4);
    assert_eq!(app.notice, None);
    adders.add(100.0);
    until(&mut app, |app| app.notice.is_some());
    let notice = app.notice.take().expect("a notice");
    shows(&notice, &["wrote to the number"]);
    adders.add(100.0);
    let now = ticks(&app);
    until(&mut app, |app| ticks(app) > now + 8);
    assert_eq!(app.notice, None, "it was noticed before");
    leave(app);
}

#[test]
fn limits_of_a_system_that_has_none_are_computed_once_and_not_awaited() {
    let mut limits = Asked::default();
    limits.ask(RunSetup::default(), |setup| Drone.judge().age_limits(setup));
    assert!((0..100).any(|_| {
        limits.receive(true);
        !limits.is_coming()
    }));
    assert!(limits.is(&RunSetup::default()), "it would be asked again");
}

#[test]
fn an_age_that_is_the_signal_is_drawn_once_with_the_figures_beside_it() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../graphs/robot.toml");
    let system = graph(&std::fs::read_to_string(path).expect("a file"));
    let config = Config {
        setup: system.about().setup(),
        end: seconds(12.0),
        ..Config::default()
    };
    let mut app = opened(SessionSetup::new(system, None), &config);
    end(&mut app);
    let drawn = screen(&app, 120, 35);
    shows(
        &drawn,
        &["3 see-to-act age", "4 figures", "p50", "overruns"],
    );
    assert!(!drawn.contains("push age (ms)"), "{drawn}");
    // Each number of drops in the graph has its word.
    let drops = drawn.lines().filter(|line| line.contains("depth 1"));
    let alone = |line: &str| line.matches("depth 1").count() > line.matches("drop").count();
    for line in drops {
        assert!(!alone(line), "{line}");
    }
    press(&mut app, "3i");
    shows(&screen(&app, 120, 35), &["The curve is the see-to-act age"]);
}
