//! The pictures of the manual, and what a run shows until it is over.

use ratatui::layout::Size;

use super::{super::picture, *};

/// The README's picture. `RATELAB_UPDATE=1 cargo test manual` draws it
/// anew.
#[test]
fn the_picture_in_the_manual_is_the_screen_as_it_is_drawn() {
    let config = config("seed 1; 4 control-hz 8; 7 control-hz 5");
    let size = Size::new(120, 40);
    let drawn = picture::draw_run(&config, learners(), size, &RICH).expect("a picture");
    is_kept("picture.svg", &drawn);
}

/// The moving picture of the README.
#[test]
fn the_moving_picture_in_the_manual_is_the_recording_as_it_is_drawn() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../recordings/fall-5hz.rrd");
    let recording = Arc::new(Recording::read(file.as_ref()).expect("a recording"));
    let (size, until) = (Size::new(80, 24), recording.until);
    let drawn = picture::moving(recording, learners(), until, 0.2, size, &RICH).expect("a picture");
    // The title of the graph is in the file once, the run time for each frame.
    assert_eq!(drawn.matches("y=\"123\">g<").count(), 1);
    assert!(drawn.matches("@keyframes").count() > 30);
    assert!(drawn.contains("prefers-reduced-motion"));
    is_kept("moving.svg", &drawn);
}

/// Sessions whose screen gives no exercise away.
fn learners() -> SessionSetup {
    SessionSetup {
        hides_limits: true,
        ..setup()
    }
}

/// Compares a drawing with the file of the manual, or updates that.
fn is_kept(name: &str, drawn: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../lab")
        .join(name);
    if std::env::var_os("RATELAB_UPDATE").is_some() {
        std::fs::write(&path, drawn).expect("written");
    }
    let kept = std::fs::read_to_string(&path).expect(name);
    assert!(
        kept == drawn,
        "lab/{name} is out of date: RATELAB_UPDATE=1 cargo test manual"
    );
}

/// All that a run shows until it is over, with what the terminal was told of each cell.
fn frames(config: Config, mut each: impl FnMut(&App, &str)) {
    let mut app = session(config);
    let mut terminal = terminal(160, 50);
    loop {
        let over = app.ended();
        sample(&mut app);
        let drawn = terminal.draw(|frame| view::render(app.screen().as_ref(), &RICH, frame));
        let warned = view::testing::styled(drawn.expect("drawn").buffer, RICH.alarm_line());
        each(&app, &warned);
        if over {
            return;
        }
    }
}

#[test]
fn a_healthy_run_shows_no_warning_whatever_it_drops() {
    for run in ["speed 20", "real; until 0.7", "sensor-hz 100"] {
        frames(config(run), |_, warned| assert_eq!(warned, "", "{run}"));
    }
}

#[test]
fn a_run_that_falls_is_warned_of_before_it_falls() {
    for knobs in [
        "control-hz 5",
        "sensor-hz 5",
        "control-hz 5; queue-depth 100",
    ] {
        let mut is_warned = false;
        frames(config(&format!("speed 1; {knobs}")), |app, warned| {
            let verdict = app.screen().map(|shown| shown.frame.verdict.standing);
            is_warned |= verdict == Some(Standing::Warned) && !warned.is_empty();
        });
        assert!(is_warned, "{knobs}");
    }
}
