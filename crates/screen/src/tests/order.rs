//! Knobs that keys turn among those that were given their times up front.

use std::time::Instant;

use ratelab::{Command, Event, EventKind, Knob};
use ratelab_system::Setup;

use super::*;

/// A run that stands still, so that no event comes but those of the test.
fn paused() -> App {
    let mut app = session(endless(""));
    press(&mut app, " ");
    app
}

/// Takes the event of `knob` when it is turned.
fn applied(app: &mut App, knob: &Knob) {
    app.follow(&Event {
        at: Time::ZERO,
        what: EventKind::Applied {
            command: knob.clone().into(),
            was: None,
        },
    });
}

/// All ways of putting `timed` between `pressed`, each in its own order.
fn interleaved(pressed: &[Knob], timed: &[Knob]) -> Vec<Vec<Knob>> {
    let places = pressed.len() + timed.len();
    // A bit for each place with a pressed one.
    let ways = (0..1_u32 << places).filter(|way| way.count_ones() as usize == pressed.len());
    let order = |way: u32| {
        let (mut pressed, mut timed) = (pressed.iter(), timed.iter());
        let next = |place| match way >> place & 1 {
            1 => pressed.next().cloned(),
            _ => timed.next().cloned(),
        };
        (0..places).filter_map(next).collect()
    };
    ways.map(order).collect()
}

#[test]
fn a_timed_knob_between_a_press_and_its_event_is_not_taken_for_the_press() {
    for (knob_of_time, sensor) in [("rate sensor 25", Some(25.0)), ("rate policy 20", None)] {
        let mut app = paused();
        press(&mut app, "[");
        applied(&mut app, &knob(knob_of_time));
        assert_eq!(rate(&app, "sensor"), sensor, "the timed knob is lost");
        assert_eq!(rate(&app, "policy"), Some(40.0), "the press is lost");
    }
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
        app.turn(Ok(pressed.to_vec()));
        order.iter().for_each(|knob| applied(&mut app, knob));
        let runs: Setup = order.iter().cloned().collect();
        let wanted = app.wanted().setup;
        assert_eq!(wanted.iter().count(), runs.iter().count());
        for knob in runs.iter() {
            assert!(wanted.iter().any(|other| other == knob), "{order:?}");
        }
    }
}

#[test]
fn a_picture_costs_the_same_however_much_has_happened() {
    let mut app = paused();
    let frames = |app: &mut App| {
        let begun = Instant::now();
        (0..20).for_each(|_| drop(app.shown.frame()));
        begun.elapsed()
    };
    app.shown.frame();
    let few = frames(&mut app);
    for _ in 0..200_000 {
        app.shown.run.send(Command::Speed(Speed::REAL_TIME));
    }
    until(&mut app, |app| app.shown.events.len() >= 200_000);
    let many = frames(&mut app);
    // Copying them all would take hundreds of times as long.
    let most = few * 10 + Duration::from_millis(20);
    assert!(many < most, "{few:?}, then {many:?}");
}
