//! Recording while a run is under way.

use std::{fs, path::Path, sync::Arc, thread, time::Duration};

use ratelab::{ClockKind, Command, Flow, Speed, Tick, Time};
use ratelab_cart_pole::CartPole;
use ratelab_experiment::{Config, Experiment};
use ratelab_recording::{
    Recorder, Source, StopReason,
    rrd::{
        schema::node_entity,
        timeline::{RUN_TIME, WALL_TIME},
    },
};
use ratelab_system::{Builder, WorldKind};

use super::{
    Made, assert_has, chunks_of, experiment, file, finish, leaks::Number, paced, read, record,
    record_run, recorder, to, verify,
};

/// Commands that turn the knobs in `text`.
fn knobs(text: &str) -> Vec<Command> {
    let knobs = CartPole::KNOBS.parse(text).expect("a knob");
    knobs.into_iter().map(Command::from).collect()
}

/// `config`, without an end.
fn endless(config: Config) -> Config {
    Config {
        end: Time::MAX,
        ..config
    }
}

#[test]
fn a_recording_made_midway_comes_again_with_ticks_that_take_time_and_without() {
    for (world, setup) in [
        (WorldKind::Course, ""),
        (WorldKind::OWN, "takes policy 30..50"),
    ] {
        let (_folder, path) = file("midway.rrd");
        let experiment = experiment(&Config {
            world,
            setup: CartPole::config(setup).expect("a setup").setup,
            ..endless(paced(10.0))
        });
        let (source, commands) = (Source::for_experiment(&experiment), experiment.commands());
        let run = thread::spawn(move || experiment.run());
        thread::sleep(Duration::from_millis(200));
        let recorder = Recorder::midway(&mut to(&path), &source).expect("recorder");
        thread::sleep(Duration::from_millis(300));
        recorder.end(StopReason::Off);
        let recorded = recorder.finish().expect("recorded");
        commands.send(Command::Stop).expect("alive");
        run.join().expect("no panic").expect("no fault");
        let recording = read(&path);
        assert!(recording.is_whole(), "{:?}", recording.defect());
        let first = recording.topics[0].heads()[0].seq;
        assert!(first > 0, "it began at the start");
        let identical = verify(&recording).expect("identical");
        assert_eq!(identical.messages as u64, recorded.messages);
        assert!(identical.messages >= 100, "{identical}");
    }
}

#[test]
fn knobs_pauses_speeds_and_refusals_come_again_whenever_the_recording_begins() {
    let config = Config {
        setup: CartPole::config("queue-depth 7").expect("a knob").setup,
        ..endless(paced(20.0))
    };
    let faster = Command::Speed(Speed::times(50.0).expect("a speed"));
    let on_to_virtual = Command::HandOver(ClockKind::Virtual);
    let groups = [
        vec![faster],
        ["send policy lqr", "send policy missing.pt", "rate nobody 3"]
            .map(knobs)
            .concat(),
        [knobs("rate policy 8"), vec![on_to_virtual]].concat(),
        vec![Command::Pause, Command::Step],
        [knobs("rate sensor 90"), vec![Command::Step]].concat(),
        knobs("queue-depth 1"),
        knobs("takes policy 45"),
        knobs("offset sensor 7"),
        vec![Command::Resume, Command::Speed(Speed::REAL_TIME)],
        vec![Command::Stop],
    ];
    for late in [false, true] {
        let (_folder, path) = file("live.rrd");
        let experiment = experiment(&config);
        let (source, commands) = (Source::for_experiment(&experiment), experiment.commands());
        let start = || Recorder::midway(&mut to(&path), &source).expect("recorder");
        let mut recorder = (!late).then(start);
        let run = thread::spawn(move || experiment.run());
        for group in &groups {
            thread::sleep(Duration::from_millis(40));
            for command in group {
                commands.send(command.clone()).expect("alive");
            }
            recorder.get_or_insert_with(start);
        }
        finish(recorder.expect("begun"), &run.join().expect("no panic"));
        let recording = read(&path);
        assert_eq!(recording.defect(), None);
        assert_eq!(recording.events.len(), 17, "{:?}", recording.events);
        verify(&recording).expect("identical");
    }
}

#[test]
fn a_file_that_vanishes_or_is_replaced_ends_its_recording_and_not_the_run() {
    for new in [None, Some("mine")] {
        let (_folder, path) = file("run.rrd");
        let experiment = experiment(&paced(20.0));
        let recorder = recorder(&experiment, &path);
        fs::remove_file(&path).expect("removed");
        let _ = new.map(|text| fs::write(&path, text).expect("written"));
        let outcome = experiment.run();
        assert_eq!(outcome.as_ref().expect("no fault").steps, 501, "{new:?}");
        recorder.end(StopReason::from_outcome(&outcome));
        let error = recorder.finish().expect_err("it is gone").to_string();
        assert_has(&error, "run.rrd");
        assert_has(&error, "gone from");
        assert_eq!(fs::read_to_string(&path).ok().as_deref(), new, "left alone");
    }
}

#[test]
fn ten_seconds_take_two_thirds_of_a_megabyte_and_their_batches_are_put_together() {
    let (_folder, path) = file("run.rrd");
    let config = Config {
        clock: ClockKind::Real,
        ..Config::default()
    };
    record(&config, &path).0.expect("no fault");
    let bytes = fs::metadata(&path).expect("file").len();
    // 14 kB of them are what the threads did, and in which order; 100 kB are the lanes of
    // ticks and messages.
    assert!(bytes <= 656 << 10, "{bytes} bytes");
}

/// Wall times (ns) and run times of the ticks of the first node in a file.
fn wall_times(path: &Path) -> Vec<(i64, i64)> {
    let mut times = Vec::new();
    for chunk in chunks_of(path) {
        if *chunk.entity_path() == node_entity("sensor") {
            let column = |name: &'static str| {
                let column = chunk.timelines().get(&name.into());
                column.map_or(Vec::new(), |column| column.times_raw().to_vec())
            };
            times.extend(column(WALL_TIME).into_iter().zip(column(RUN_TIME)));
        }
    }
    times
}

#[test]
fn wall_time_goes_on_while_run_time_pauses() {
    let (_folder, path) = file("paused.rrd");
    let experiment = experiment(&endless(Config {
        clock: ClockKind::Real,
        ..Config::default()
    }));
    let commands = experiment.commands();
    let recorder = recorder(&experiment, &path);
    let run = thread::spawn(move || experiment.run());
    for command in [Command::Pause, Command::Resume, Command::Stop] {
        thread::sleep(Duration::from_millis(500));
        commands.send(command).expect("alive");
    }
    finish(recorder, &run.join().expect("no panic"));
    let recording = read(&path);
    let mut events = recording.events.iter();
    let resumed = events
        .find(|event| event.applied() == Some(&Command::Resume))
        .expect("resumed")
        .at
        .as_nanos() as i64;
    let times = wall_times(&path);
    let offset = |(wall, run): &(i64, i64)| wall - run;
    let (before, after): (Vec<_>, Vec<_>) = times.iter().partition(|(_, run)| *run <= resumed);
    let jump = after.iter().map(offset).min() > before.iter().map(offset).max();
    assert!(jump && before.len() > 10 && after.len() > 10, "{times:?}");
    let pause = offset(&after[0]) - offset(&before[0]);
    assert!(pause > 400_000_000, "a pause of {pause} ns");
}

#[test]
fn the_recording_of_a_run_that_fails_is_complete() {
    let (_folder, path) = file("failed.rrd");
    let system = Made("fails", |builder: &mut Builder<'_>| {
        let topic = builder.topic::<Number>("/number");
        builder.node("breaks", 50.0, 0, move |wiring| {
            let (numbers, mut number) = (wiring.publisher(&topic), 0.0);
            move |tick: &mut Tick| {
                if number == 9.0 {
                    return Err("it has enough".into());
                }
                number += 1.0;
                tick.publish(&numbers, Number { number });
                Ok(Flow::Continue)
            }
        })
    });
    let experiment = Experiment::new(Arc::new(system), &Config::default());
    let (outcome, _) = record_run(experiment.expect("experiment"), &path);
    assert!(outcome.is_err(), "it did not fail");
    let recording = read(&path);
    assert!(recording.is_whole());
    assert_has(&format!("{:?}", recording.outcome), "it has enough");
    assert_eq!(recording.messages::<Number>("/number").len(), 9);
}
