//! Knobs that keys turn among those that were given their times up front.

use ratelab::{
    experiment::{Config, Knob, parse_knobs},
    runtime::{
        Command, Speed, Time,
        telemetry::{Event, EventKind},
    },
};

use super::*;

/// A run that stands still, so that no event comes but those of the test.
fn paused() -> App {
    let config = Config {
        speed: Speed::REAL_TIME,
        end: Time::MAX,
        ..Config::default()
    };
    let mut app = App::new(&config, Setup::default()).expect("session");
    press(&mut app, " ");
    app
}

fn knob(text: &str) -> Knob {
    let timed = parse_knobs(&format!("0 {text}")).expect("a knob");
    timed[0].knob.clone()
}

/// What the graph tells when `knob` is turned.
fn applied(knob: &Knob) -> Vec<Event> {
    let commands = knob.commands().into_iter();
    let events = commands.map(|command| Event {
        at: Time::ZERO,
        what: EventKind::Applied { command, was: None },
    });
    events.collect()
}

/// All ways of putting `timed` between `pressed`, each in its own order.
fn interleaved(pressed: &[Knob], timed: &[Knob]) -> Vec<Vec<Knob>> {
    match (pressed, timed) {
        ([], rest) | (rest, []) => vec![rest.to_vec()],
        ([first, pressed @ ..], [other, later @ ..]) => {
            let begin = |knob: &Knob, rest: Vec<Vec<Knob>>| {
                let whole = rest
                    .into_iter()
                    .map(|rest| [vec![knob.clone()], rest].concat());
                whole.collect::<Vec<_>>()
            };
            let own = begin(first, interleaved(pressed, timed));
            let other = begin(
                other,
                interleaved(&[std::slice::from_ref(first), pressed].concat(), later),
            );
            [own, other].concat()
        }
    }
}

#[test]
fn a_timed_knob_between_a_press_and_its_event_is_not_taken_for_the_press() {
    let mut app = paused();
    press(&mut app, "[");
    for event in applied(&knob("sensor-hz 25")) {
        app.on_event(&event);
    }
    let wanted = app.wanted();
    assert_eq!(wanted.sensor_hz.get(), 25.0, "the timed knob is lost");
    assert_eq!(wanted.control_hz.get(), 40.0, "the press is lost");
}

#[test]
fn in_every_order_what_is_wanted_ends_as_what_runs() {
    let pressed = ["control-hz 40", "control-hz 30", "queue-depth 2"].map(knob);
    let timed = [
        "control-hz 20",
        "sensor-hz 25",
        "control-hz 40",
        "queue-depth 5",
    ]
    .map(knob);
    let orders = interleaved(&pressed, &timed);
    assert_eq!(orders.len(), 35);
    for order in orders {
        let mut app = paused();
        for knob in &pressed {
            app.turn_to(knob.clone());
        }
        let mut runs = app.wanted().clone();
        for event in order.iter().flat_map(applied) {
            app.on_event(&event);
        }
        for knob in &order {
            match *knob {
                Knob::ControlHz(hz) => runs.control_hz = hz,
                Knob::SensorHz(hz) => runs.sensor_hz = hz,
                Knob::QueueDepth(depth) => runs.queue_depth = depth,
                Knob::Policy(_) => unreachable!("none is turned"),
            }
        }
        assert_eq!(*app.wanted(), runs, "{order:?}");
    }
}

#[test]
fn a_press_outlasts_a_timed_knob_that_comes_before_it_takes_effect() {
    let mut app = paused();
    press(&mut app, "[");
    for event in applied(&knob("control-hz 20")) {
        app.on_event(&event);
    }
    assert_eq!(app.wanted().control_hz.get(), 40.0);
}

#[test]
fn a_picture_costs_the_same_however_much_has_happened() {
    let mut app = paused();
    let frames = |app: &mut App| {
        let begun = std::time::Instant::now();
        (0..20).for_each(|_| drop(app.picture_now()));
        begun.elapsed()
    };
    app.picture_now();
    let few = frames(&mut app);
    for _ in 0..200_000 {
        app.session().send(Command::Speed(Speed::REAL_TIME));
    }
    while app.events(Time::MAX).count() < 200_000 {
        app.sample().expect("no fault");
    }
    let many = frames(&mut app);
    // Copying them all would take hundreds of times as long.
    assert!(
        many < few * 10 + Duration::from_millis(20),
        "{few:?}, then {many:?}"
    );
}
