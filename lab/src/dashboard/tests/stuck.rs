//! Leaving a run, and starting again, while a node is stuck in its tick.

use crossbeam_channel::{Receiver, Sender, bounded};
use ratelab::{ClockKind, Time};
use ratelab_cart_pole::{Action, CartPole, Observation, policy::Policy};
use ratelab_study::experiment::Config;

use super::*;
use crate::{dashboard::sampler::RunSource, recording::Recording};

/// Decides nothing until the sender of `release` is gone.
struct Stuck {
    begun: Sender<()>,
    release: Receiver<()>,
}

impl Policy for Stuck {
    fn name(&self) -> &str {
        "stuck"
    }

    fn act(&mut self, _: &Observation) -> Action {
        let _ = self.begun.try_send(());
        let _ = self.release.recv();
        Action(0.0)
    }
}

/// A lab over a run whose policy is in a tick that ends when the sender is gone.
fn stuck() -> (App, Sender<()>) {
    let config = Config {
        clock: ClockKind::Real,
        end: Time::MAX,
        ..Config::default()
    };
    let (begun, begins) = bounded(1);
    let (held, release) = bounded(1);
    let system = CartPole::with_policy(move |_| {
        Box::new(Stuck {
            begun: begun.clone(),
            release: release.clone(),
        })
    });
    let setup = SessionSetup {
        system: Arc::new(system),
        ..setup()
    };
    let app = App::new(&config, setup).expect("session");
    begins.recv().expect("the policy ticks");
    (app, held)
}

#[test]
fn leaving_tells_what_it_waits_for_and_leaves_when_that_has_come() {
    let (mut app, held) = stuck();
    press(&mut app, "q");
    app.sample().expect("no fault");
    assert!(!app.wants_quit(), "it does not wait");
    for (width, height) in [(80, 24), (160, 50)] {
        let drawn = screen(&app, &PLAIN, width, height);
        let told = "waiting for policy, still in a tick: q again or Ctrl-C ends without it";
        assert!(drawn.contains(told), "{drawn}");
    }
    drop(held);
    while !app.wants_quit() {
        app.sample().expect("no fault");
    }
    app.finish().ended.expect("it ended in order");
}

#[test]
fn a_second_q_leaves_at_once() {
    for keys in ["qq", "rq"] {
        let (mut app, held) = stuck();
        press(&mut app, keys);
        assert!(app.wants_quit(), "{keys}");
        let error = app.finish().ended.expect_err("it did not end").to_string();
        assert!(error.contains("policy is still in a tick"), "{error}");
        drop(held);
    }
}

#[test]
fn a_restart_comes_when_the_node_is_done() {
    let (mut app, held) = stuck();
    press(&mut app, "r");
    let drawn = screen_after_sample(&mut app);
    let told = "waiting for policy, still in a tick: q or Ctrl-C ends without it";
    assert!(drawn.contains(told), "{drawn}");
    drop(held);
    while app.desk().run.summary().is_some() || app.desk().notice.is_some() {
        app.sample().expect("no fault");
    }
    assert!(!app.wants_quit() && !app.ended());
    press(&mut app, "q");
    app.finish().ended.expect("the new run ended in order");
}

fn screen_after_sample(app: &mut App) -> String {
    app.sample().expect("no fault");
    screen(app, &PLAIN, 80, 24)
}

#[test]
fn the_recording_of_a_run_that_is_left_stuck_is_complete() {
    let folder = tempfile::tempdir().expect("folder");
    let (mut app, held) = stuck();
    app.record_to(folder.path());
    press(&mut app, "wqq");
    let left = app.finish();
    left.ended.expect_err("it did not end");
    assert_eq!(left.recorded.len(), 1);
    let recording = Recording::read(&left.recorded[0].path);
    let recording = recording.expect("readable");
    assert!(recording.defect().is_none(), "{:?}", recording.defect());
    drop(held);
}

#[test]
fn run_time_stands_still_while_the_program_is_stopped() {
    for clock in [ClockKind::Virtual, ClockKind::Real] {
        let config = Config {
            clock,
            speed: ratelab::Speed::REAL_TIME,
            end: Time::MAX,
            ..Config::default()
        };
        let mut app = App::new(&config, setup()).expect("session");
        app.sample().expect("no fault");
        app.rest();
        assert!(app.desk().run.observer().status().paused);
        app.go_on();
        while app.desk().run.observer().status().paused {
            std::thread::yield_now();
        }
        // A pause that the person wanted stays.
        press(&mut app, " ");
        app.rest();
        app.go_on();
        while !app.desk().run.observer().status().paused {
            std::thread::yield_now();
        }
        app.finish().ended.expect("no fault");
    }
}

#[test]
fn a_paste_is_text_where_text_is_typed_and_nothing_elsewhere() {
    let mut app = ended(Config::default());
    app.paste("qwe\r");
    assert!(!app.wants_quit() && app.desk().prompt.typed().is_none());
    press(&mut app, ":");
    app.paste("control-hz\r\n7.5\n");
    assert_eq!(app.desk().prompt.typed(), Some("control-hz  7.5 "));
    let enter = KeyEvent::new(KeyCode::Enter, KeyModifiers::NONE);
    app.key(&enter).expect("obeyed");
    assert_eq!(rate(&app, "policy"), Some(7.5));
}
