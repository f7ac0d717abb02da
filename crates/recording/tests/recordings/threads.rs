//! Runs of the real clock come again from their log, and an altered one is found.

use std::{fs, thread, time::Duration};

use ratelab::{ClockKind, Command, Time};
use ratelab_cart_pole::CartPole;
use ratelab_experiment::Config;
use ratelab_recording::{Recorder, Recording, Source};

use super::{
    altered::{alter, exchange},
    assert_has, experiment, file, finish, found, ms, read, record, recorder, to, verify,
};

/// A short run of the real clock, set up by `setup`.
fn real(setup: &str, seconds: f64) -> Config {
    Config {
        setup: CartPole::config(setup).expect("a setup").setup,
        ..super::real(Time::from_secs_f64(seconds).expect("a time"))
    }
}

/// The recording of such a run.
fn recorded(setup: &str, seconds: f64) -> Recording {
    super::recorded(&real(setup, seconds)).0
}

#[test]
fn a_session_between_the_clocks_that_was_recorded_midway_comes_again() {
    let (_folder, path) = file("mixed.rrd");
    let mut config = real("control-hz 25", 0.6);
    config.clock = ClockKind::Virtual;
    let experiment = experiment(&config);
    let (commands, observer) = (experiment.commands(), experiment.observer());
    let source = Source::for_experiment(&experiment);
    let run = thread::spawn(move || experiment.run());
    let at = |seconds| {
        while observer.now() < Time::from_secs_f64(seconds).expect("a time") {
            thread::sleep(Duration::from_millis(1));
        }
    };
    let send = |command| commands.send(command).expect("alive");
    at(0.1);
    send(Command::HandOver(ClockKind::Real));
    at(0.2);
    let recorder = Recorder::midway(&mut to(&path), &source).expect("begun");
    at(0.3);
    send(Command::Set("rate policy 80".parse().expect("a knob")));
    send(Command::HandOver(ClockKind::Virtual));
    finish(recorder, &run.join().expect("no panic"));
    let recording = read(&path);
    verify(&recording).expect("identical");
    let error = found(&recording, |recording| recording.threads = None);
    assert_has(&error, "for a while");
}

#[test]
fn a_torn_file_comes_again_up_to_its_last_batch() {
    let (_folder, path) = file("torn.rrd");
    let experiment = experiment(&real("sensor-hz 200, takes policy 15", 1.6));
    let recorder = recorder(&experiment, &path);
    let observer = experiment.observer();
    let run = thread::spawn(move || experiment.run());
    while observer.now() < ms(1300) {
        thread::sleep(Duration::from_millis(1));
    }
    let bytes = fs::read(&path).expect("read");
    finish(recorder, &run.join().expect("no panic"));
    fs::write(&path, bytes).expect("written");
    let torn = read(&path);
    assert!(torn.outcome.is_none());
    let identical = verify(&torn).expect("identical");
    assert!(identical.messages > 0);
    let until = identical.until.expect("it is cut off");
    assert!(until > ms(500), "{until}");
}

#[test]
fn an_exchange_of_two_pieces_of_the_log_is_refused_although_it_commutes() {
    let (_folder, path) = file("real.rrd");
    record(&real("", 0.2), &path).0.expect("no fault");
    // The first pieces are of different threads: the log is the same.
    alter(&path, "/threads", "piece", |column| {
        exchange(column, [0, 1])
    });
    let error = verify(&read(&path)).expect_err("the digests differ");
    assert_has(&error.to_string(), "missing or was changed");
}

#[test]
fn another_duration_of_a_tick_of_the_real_clock_is_found_and_named() {
    let original = recorded("control-hz 100", 0.3);
    for node in 0..original.ticks.len() {
        let error = found(&original, |altered| {
            let tick = altered.ticks[node].last_mut().expect("a tick");
            tick.took = tick.took.map(|took| took + Time::RESOLUTION);
        });
        assert_has(&error, "duration");
    }
}

#[test]
fn a_recording_of_the_real_clock_without_its_order_is_refused_with_that_reason() {
    let error = found(&recorded("", 0.2), |old| old.threads = None);
    assert_has(&error, "lacks the order");
}

#[test]
fn what_came_too_fast_for_the_recorder_may_be_missing_and_nothing_else() {
    let mut lost = recorded("control-hz 100", 0.3);
    lost.outcome.as_mut().expect("an end").lost = 2;
    let none_is_missing = verify(&lost).expect_err("none is missing");
    assert_has(&none_is_missing.to_string(), "what came too fast");
    lost.ticks[0].remove(3);
    lost.ticks[1].remove(5);
    verify(&lost).expect("the rest is identical");
    lost.ticks[2].remove(4);
    let error = verify(&lost).expect_err("one more is missing");
    assert_has(&error.to_string(), "differs");
}
