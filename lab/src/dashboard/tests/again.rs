//! A recording whose run is executed again while it is played.

use std::{fs, path::Path};

use ratelab::ClockKind;

use super::{super::player::Player, adders::Adders, *};
use crate::recording::{Destination, Recording};

fn config(knobs: &str, seconds: f64) -> Config {
    Config {
        clock: ClockKind::Real,
        end: Time::from_secs_f64(seconds).expect("a time"),
        ..CartPole::config(knobs).expect("knobs")
    }
}

/// The recording of a session of `config`, begun at run time `from` (s).
fn recorded(setup: SessionSetup, config: &Config, from: f64, folder: &Path) -> Recording {
    let setup = SessionSetup {
        record: Some(Destination::new(Some(folder.to_owned()))),
        ..setup
    };
    let mut app = App::new(config, setup).expect("session");
    if from > 0.0 {
        press(&mut app, "w");
        while app.sample().is_ok() && now(&app) < from {}
        press(&mut app, "w");
    }
    while !app.ended() {
        app.sample().expect("no fault");
    }
    let recorded = app.finish().recorded;
    let newest = recorded.last().expect("a recording");
    let recording = Recording::read(&newest.path).expect("readable");
    recorded
        .iter()
        .for_each(|recorded| fs::remove_file(&recorded.path).expect("removed"));
    recording
}

fn now(app: &App) -> f64 {
    let screen = app.screen();
    screen.map_or(0.0, |screen| screen.frame.now.as_secs_f64())
}

/// Plays `recording`, and begins to execute its run again.
fn played(setup: &SessionSetup, recording: Recording) -> Player {
    let mut player = Player::new(Arc::new(recording), &setup.system);
    player.execute_again();
    player
}

/// What the player says once it executes nothing.
fn settled(player: &mut Player) -> String {
    loop {
        player.sample().expect("readable");
        let notice = player.screen().and_then(|screen| screen.bottom.notice);
        if let Some(notice) = notice.filter(|notice| !notice.contains("executing")) {
            return notice.to_owned();
        }
    }
}

fn key(player: &mut Player, code: KeyCode) {
    let key = KeyEvent::new(code, KeyModifiers::NONE);
    player.key(&key).expect("obeyed");
}

/// What the player says after a key.
fn said(player: &mut Player, letter: char) -> String {
    key(player, KeyCode::Char(letter));
    settled(player)
}

fn ticks(player: &Player) -> u64 {
    let screen = player.screen().expect("a frame");
    screen.frame.nodes.iter().map(|node| node.ticks).sum()
}

#[test]
fn a_recording_that_began_midway_is_played_from_the_start_of_the_run() {
    let folder = tempfile::tempdir().expect("a folder");
    for clock in [ClockKind::Real, ClockKind::Virtual] {
        let config = Config {
            clock,
            speed: Speed::REAL_TIME,
            ..config("control-hz 25", 0.6)
        };
        let recording = recorded(setup(), &config, 0.2, folder.path());
        let (rows, first) = (recording.ticks[0].len(), recording.ticks[0][0].at);
        assert!(first > Time::from_nanos(100_000_000));
        let mut player = played(&setup(), recording);
        let notice = settled(&mut player);
        assert!(notice.contains("executed again"), "{notice}");
        key(&mut player, KeyCode::Home);
        player.sample().expect("readable");
        let screen = player.screen().expect("a frame");
        let begins = screen.scrubber.expect("a position").begins;
        // A busy machine begins late under the real clock, but not that late.
        let limit = match clock {
            ClockKind::Virtual => Time::from_nanos(20_000_000),
            ClockKind::Real => first,
        };
        assert!(begins < limit, "{begins}");
        key(&mut player, KeyCode::End);
        player.sample().expect("readable");
        let screen = player.screen().expect("a frame");
        assert!(screen.frame.nodes[0].ticks > rows as u64);
    }
}

#[test]
fn a_recording_that_this_program_runs_differently_is_shown_from_its_rows() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut recording = recorded(setup(), &config("", 0.2), 0.0, folder.path());
    let tick = recording.ticks[1].last_mut().expect("a tick");
    tick.took = tick.took.map(|took| took + Duration::from_nanos(1));
    let mut player = played(&setup(), recording);
    let notice = settled(&mut player);
    assert!(
        notice.contains("shown from its rows: this program"),
        "{notice}"
    );
    assert!(player.screen().is_some());
}

#[test]
fn ticks_that_overlap_are_stepped_through_operation_by_operation() {
    let folder = tempfile::tempdir().expect("a folder");
    let setup = SessionSetup::new(Arc::new(Adders::default()), false);
    let config = Config {
        clock: ClockKind::Real,
        end: Time::from_nanos(100_000_000),
        ..Config::default()
    };
    let recording = recorded(setup.clone(), &config, 0.0, folder.path());
    let mut player = played(&setup, recording);
    // The first ticks overlap, too.
    key(&mut player, KeyCode::Home);
    let first = loop {
        let first = said(&mut player, 'o');
        if first != "the run is still executed again" {
            break first;
        }
    };
    assert!(
        first.contains(": operation 1 of ") && first.contains(" locks "),
        "{first}"
    );
    let drawn = |player: &Player| {
        let mut terminal = Terminal::new(TestBackend::new(80, 24)).expect("terminal");
        let drawn = terminal.draw(|frame| view::render(player.screen().as_ref(), &PLAIN, frame));
        drawn.expect("drawn");
        terminal.backend().to_string()
    };
    let screen = drawn(&player);
    assert!(
        screen.contains("operation 1 of") && screen.contains('▶'),
        "{screen}"
    );
    let before = ticks(&player);
    let second = said(&mut player, 'o');
    assert!(second.contains(": operation 2 of "), "{second}");
    assert_eq!(said(&mut player, 'O'), first);
    assert_eq!(ticks(&player), before);
    // A step by ticks leaves it.
    key(&mut player, KeyCode::Char('.'));
    player.sample().expect("readable");
    assert!(!drawn(&player).contains("operation 1 of"));
    key(&mut player, KeyCode::End);
    let none = said(&mut player, 'o');
    assert!(none.contains("no ticks overlap after this"), "{none}");
}
