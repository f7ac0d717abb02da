//! Keys for links, and what faults look like.

use super::*;

/// The knobs that are set.
fn set(app: &App) -> Vec<String> {
    let setup = app.wanted().setup;
    setup.iter().map(ToString::to_string).collect()
}

#[test]
fn keys_delay_the_marked_topic_and_let_it_lose() {
    let mut app = running();
    press(&mut app, "ttdddD");
    assert_eq!(set(&app), ["link /action delay:10"]);
    press(&mut app, "llD");
    assert_eq!(set(&app), ["link /action delay:5,loss:0.05"]);
    press(&mut app, "DLLL");
    assert_eq!(set(&app), ["link /action none"]);
    let drawn = screen(&app, &PLAIN, 120, 36);
    assert!(
        drawn.contains("the loss of /action is at its lowest, 0"),
        "{drawn}"
    );
}

#[test]
fn keys_leave_the_other_parts_of_a_link() {
    let mut app = running();
    press(&mut app, "tt:link /action delay:5..9,in-order\nl");
    assert_eq!(set(&app), ["link /action delay:5..9,in-order,loss:0.01"]);
    press(&mut app, "d");
    assert_eq!(set(&app).len(), 1);
    let drawn = screen(&app, &PLAIN, 120, 36);
    assert!(drawn.contains("the delay is drawn"), "{drawn}");
}

#[test]
fn a_crashed_node_is_seen_until_it_is_restarted() {
    let mut app = running();
    let wait = |app: &mut App, seen: bool| {
        while screen(app, &PLAIN, 120, 36).contains("✖ crashed") != seen {
            app.sample().expect("no fault");
        }
    };
    press(&mut app, ":crash policy\n");
    wait(&mut app, true);
    press(&mut app, ":restart policy\n");
    wait(&mut app, false);
}
