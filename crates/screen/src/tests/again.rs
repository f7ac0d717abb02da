//! A recording whose run is executed again while it is played.

use super::{adders::Adders, *};

/// Plays `recording`, and begins to execute its run again.
fn played(setup: SessionSetup, recording: Recording) -> App {
    let mut app = App::for_recording(Arc::new(recording), setup);
    app.play();
    app.execute_again();
    app
}

/// What is said once nothing is executed.
fn settled(app: &mut App) -> String {
    sample(app);
    until(app, |app| {
        !said(app).is_empty() && !said(app).contains("executing")
    });
    said(app).to_owned()
}

/// What is said after `keys`.
fn said_to(app: &mut App, keys: &str) -> String {
    press(app, keys);
    settled(app)
}

#[test]
fn a_recording_that_began_midway_is_played_from_the_start_of_the_run() {
    for clock in ["real", "speed 1"] {
        let config = config(&format!("{clock}; until 0.6; control-hz 25"));
        let recording = recorded(setup(), &config, 0.2);
        let (rows, first) = (recording.ticks[0].len(), recording.ticks[0][0].at);
        assert!(first > seconds(0.1));
        let mut app = played(setup(), recording);
        shows(&settled(&mut app), &["executed again"]);
        press(&mut app, "⇱");
        sample(&mut app);
        let begins = app
            .screen()
            .and_then(|screen| screen.scrubber)
            .expect("a position")
            .begins;
        // A busy machine begins late under the real clock, but not that late.
        let limit = match clock {
            "real" => first,
            _ => seconds(0.02),
        };
        assert!(begins < limit, "{begins}");
        press(&mut app, "⇲");
        sample(&mut app);
        assert!(frame(&app).nodes[0].ticks > rows as u64);
    }
}

#[test]
fn a_recording_that_this_program_runs_differently_is_shown_from_its_rows() {
    let mut recording = recorded(setup(), &config("real; until 0.2"), 0.0);
    let tick = recording.ticks[1].last_mut().expect("a tick");
    tick.took = tick.took.map(|took| took + Duration::from_nanos(1));
    let mut app = played(setup(), recording);
    shows(&settled(&mut app), &["shown from its rows: this program"]);
    assert!(app.screen().is_some());
}

#[test]
fn ticks_that_overlap_are_stepped_through_operation_by_operation() {
    let setup = SessionSetup::new(Arc::new(Adders::default()), None);
    let recording = recorded(setup.clone(), &config("real; until 0.1"), 0.0);
    let mut app = played(setup, recording);
    // The first ticks overlap, too.
    press(&mut app, "⇱");
    let first = loop {
        let first = said_to(&mut app, "o");
        if first != "the run is still executed again" {
            break first;
        }
    };
    shows(&first, &[": operation 1 of ", " locks "]);
    shows(&small(&app), &["operation 1 of", "▶"]);
    let before = ticks(&app);
    shows(&said_to(&mut app, "o"), &[": operation 2 of "]);
    assert_eq!(said_to(&mut app, "O"), first);
    assert_eq!(ticks(&app), before);
    // A step by ticks leaves it.
    press(&mut app, ".");
    sample(&mut app);
    assert!(!small(&app).contains("operation 1 of"));
    shows(&said_to(&mut app, "⇲o"), &["no ticks overlap after this"]);
}
