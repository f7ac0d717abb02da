//! Knobs that keys turn among those that were given their times up front.

use ratelab::{Command, Event, EventKind, Knob, Speed, Time};
use ratelab_study::experiment::Config;

use super::*;

/// A run that stands still, so that no event comes but those of the test.
fn paused() -> App {
    let config = Config {
        speed: Speed::REAL_TIME,
        end: Time::MAX,
        ..Config::default()
    };
    let mut app = App::new(&config, setup()).expect("session");
    press(&mut app, " ");
    app
}

fn knob(text: &str) -> Knob {
    text.parse().expect("a knob")
}

/// The event of `knob` when it is turned.
fn applied(knob: &Knob) -> Event {
    Event {
        at: Time::ZERO,
        what: EventKind::Applied {
            command: knob.clone().into(),
            was: None,
        },
    }
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
    app.on_event(&applied(&knob("rate sensor 25")));
    assert_eq!(rate(&app, "sensor"), Some(25.0), "the timed knob is lost");
    assert_eq!(rate(&app, "policy"), Some(40.0), "the press is lost");
}

#[test]
fn in_every_order_what_is_wanted_ends_as_what_runs() {
    let pressed = ["rate policy 40", "rate policy 30", "depth /obs 2"].map(knob);
    let timed = [
        "rate policy 20",
        "rate sensor 25",
        "rate policy 40",
        "depth /obs 5",
    ]
    .map(knob);
    let orders = interleaved(&pressed, &timed);
    assert_eq!(orders.len(), 35);
    for order in orders {
        let mut app = paused();
        for knob in &pressed {
            app.turn_to(vec![knob.clone()]);
        }
        for event in order.iter().map(applied) {
            app.on_event(&event);
        }
        let runs: ratelab_study::system::Setup = order.iter().cloned().collect();
        let wanted = app.wanted().setup;
        assert_eq!(wanted.iter().count(), runs.iter().count());
        for knob in runs.iter() {
            assert!(wanted.iter().any(|other| other == knob), "{order:?}");
        }
    }
}

#[test]
fn a_press_outlasts_a_timed_knob_that_comes_before_it_takes_effect() {
    let mut app = paused();
    press(&mut app, "[");
    app.on_event(&applied(&knob("rate policy 20")));
    assert_eq!(rate(&app, "policy"), Some(40.0));
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
        app.desk().run.send(Command::Speed(Speed::REAL_TIME));
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
