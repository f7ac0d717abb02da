//! Recording while a run is under way.

use std::{fs, path::Path, thread, time::Duration};

use ratelab::{
    cartpole::{Action, Observation},
    experiment::{Config, Experiment, Knob},
    policy::Policy,
    runtime::{ClockKind, Command, Depth, Hz, Speed, Time, TimedCommand, telemetry::EventKind},
};

use super::{folder, paced, read, record, recorder, verify};
use crate::recording::{
    Recorder, Source, StopReason,
    frames::Chunks,
    schema::node_entity,
    timeline::{RUN_TIME, WALL_TIME},
};

#[test]
fn a_session_with_knobs_turned_live_comes_again() {
    let folder = folder();
    let path = folder.path().join("live.rrd");
    let config = Config {
        end: Time::MAX,
        ..paced(20.0)
    };
    let experiment = Experiment::new(&config).expect("experiment");
    let commands = experiment.commands();
    let recorder = recorder(&experiment, &config, &path);
    let run = thread::spawn(move || experiment.run());
    let pause = Duration::from_millis(40);
    let hz = |hz| Hz::new(hz).expect("a rate");
    for command in [
        Knob::ControlHz(hz(12.0)).commands(),
        vec![Command::Pause, Command::Step, Command::Step],
        // What no knob can do.
        vec![Command::Set(Knob::Rate {
            node: "actuator".to_owned(),
            hz: hz(40.0),
        })],
        vec![Command::Set(Knob::Depth {
            topic: "/action".to_owned(),
            depth: Depth::ONE,
        })],
        vec![Command::Resume],
        Knob::ControlHz(hz(50.0)).commands(),
        vec![Command::Stop],
    ] {
        thread::sleep(pause);
        command
            .into_iter()
            .for_each(|c| commands.send(c).expect("alive"));
    }
    let outcome = run.join().expect("no panic");
    recorder.end(StopReason::of(&outcome));
    recorder.finish().expect("recorded");
    let recording = read(&path);
    assert!(recording.events.len() >= 8, "{:?}", recording.events);
    verify(&recording).expect("identical");
}

#[test]
fn a_recording_made_midway_comes_again() {
    let folder = folder();
    let path = folder.path().join("midway.rrd");
    let config = Config {
        end: Time::MAX,
        ..paced(10.0)
    };
    let experiment = Experiment::new(&config).expect("experiment");
    let (source, commands) = (Source::of(&experiment, &config), experiment.commands());
    let run = thread::spawn(move || experiment.run());
    thread::sleep(Duration::from_millis(200));
    let recorder = Recorder::midway(&path, &source).expect("recorder");
    thread::sleep(Duration::from_millis(300));
    recorder.end(StopReason::Off);
    let recorded = recorder.finish().expect("recorded");
    commands.send(Command::Stop).expect("alive");
    run.join().expect("no panic").expect("no fault");
    let recording = read(&path);
    assert!(recording.is_whole());
    assert!(
        recording.topics[0].heads[0].seq > 0,
        "it began at the start"
    );
    let identical = verify(&recording).expect("identical");
    assert_eq!(identical.messages as u64, recorded.messages);
    assert!(identical.messages >= 100, "{identical}");
}

#[test]
fn pauses_speeds_and_refusals_come_again_whenever_the_recording_begins() {
    let folder = folder();
    let config = Config {
        end: Time::MAX,
        queue_depth: "7".parse().expect("a depth"),
        ..paced(20.0)
    };
    let tell = |what: &str| Command::Send {
        node: "policy".to_owned(),
        text: what.to_owned(),
    };
    let rate = |node: &str, hz: &str| Command::SetRate {
        node: node.to_owned(),
        hz: hz.parse().expect("a rate"),
    };
    let depth = |depth: &str| Knob::parse("queue-depth", depth).expect("a knob");
    for late in [false, true] {
        let path = folder.path().join(format!("{late}.rrd"));
        let experiment = Experiment::new(&config).expect("experiment");
        let (source, commands) = (Source::of(&experiment, &config), experiment.commands());
        let start = || Recorder::midway(&path, &source).expect("recorder");
        let mut recorder = (!late).then(start);
        let run = thread::spawn(move || experiment.run());
        for command in [
            vec![Command::Speed(Speed::times(50.0).expect("a speed"))],
            vec![tell("lqr"), tell("missing.pt"), rate("nobody", "3")],
            vec![rate("policy", "8"), Command::HandOver(ClockKind::Virtual)],
            vec![
                Command::Pause,
                Command::Step,
                rate("sensor", "90"),
                Command::Step,
            ],
            depth("1").commands(),
            vec![Command::Resume, Command::Speed(Speed::REAL_TIME)],
            vec![Command::Stop],
        ] {
            thread::sleep(Duration::from_millis(40));
            for command in command {
                commands.send(command).expect("alive");
            }
            recorder = recorder.or_else(|| Some(start()));
        }
        let outcome = run.join().expect("no panic");
        let recorder = recorder.expect("one was started");
        recorder.end(StopReason::of(&outcome));
        recorder.finish().expect("recorded");
        let recording = read(&path);
        assert_eq!(recording.defect(), None);
        assert_eq!(recording.events.len(), 15, "{:?}", recording.events);
        verify(&recording).expect("identical");
    }
}

#[test]
fn a_file_that_exists_is_not_written_to() {
    let folder = folder();
    let path = folder.path().join("mine.rrd");
    fs::write(&path, "mine").expect("written");
    let config = Config::default();
    let experiment = Experiment::new(&config).expect("experiment");
    let source = Source::of(&experiment, &config);
    assert!(Recorder::from_the_start(&path, &source).is_err());
    assert_eq!(fs::read_to_string(&path).expect("read"), "mine");
}

#[test]
fn a_file_that_vanishes_ends_its_recording_and_not_the_run() {
    let folder = folder();
    let path = folder.path().join("gone.rrd");
    let config = paced(4.0);
    let experiment = Experiment::new(&config).expect("experiment");
    let recorder = recorder(&experiment, &config, &path);
    fs::remove_file(&path).expect("removed");
    let outcome = experiment.run();
    assert_eq!(outcome.as_ref().expect("no fault").steps, 501);
    recorder.end(StopReason::of(&outcome));
    let error = recorder.finish().expect_err("it is gone").to_string();
    assert!(
        error.contains("gone.rrd") && error.contains("gone from"),
        "{error}"
    );
}

#[test]
fn a_file_that_took_the_place_of_a_recording_is_left_alone() {
    let folder = folder();
    let path = folder.path().join("run.rrd");
    let config = paced(20.0);
    let experiment = Experiment::new(&config).expect("experiment");
    let recorder = recorder(&experiment, &config, &path);
    fs::rename(&path, folder.path().join("moved.rrd")).expect("moved");
    fs::write(&path, "mine").expect("written");
    let outcome = experiment.run();
    recorder.end(StopReason::of(&outcome));
    assert!(recorder.finish().is_err(), "it was written elsewhere");
    assert_eq!(fs::read_to_string(&path).expect("read"), "mine");
}

#[test]
fn ten_seconds_take_half_a_megabyte_and_their_batches_are_put_together() {
    let folder = folder();
    let path = folder.path().join("run.rrd");
    let config = Config {
        clock: ClockKind::Real,
        ..Config::default()
    };
    record(&config, &path).0.expect("no fault");
    let bytes = fs::metadata(&path).expect("file").len();
    assert!(bytes <= 512 << 10, "{bytes} bytes");
}

#[test]
fn nothing_is_verified_of_a_run_that_saw_the_real_clock() {
    let folder = folder();
    let path = folder.path().join("both.rrd");
    let config = paced(1.0);
    let mut experiment = Experiment::new(&config).expect("experiment");
    let at = |millis: u64, command| TimedCommand {
        at: Time::from_nanos(millis * 1_000_000),
        command,
    };
    experiment.schedule(vec![
        at(100, Command::HandOver(ClockKind::Real)),
        at(300, Command::Stop),
    ]);
    let recorder = recorder(&experiment, &config, &path);
    let outcome = experiment.run();
    recorder.end(StopReason::of(&outcome));
    recorder.finish().expect("recorded");
    let error = verify(&read(&path)).expect_err("no two are the same");
    assert!(error.to_string().contains("for a while"), "{error}");
}

/// Wall times (ns) and run times of the ticks of the first node in a file.
fn wall_times(path: &Path) -> Vec<(i64, i64)> {
    let bytes = fs::read(path).expect("read");
    let mut times = Vec::new();
    for chunk in Chunks::new(&bytes) {
        if chunk.entity_path().to_string() == node_entity("sensor") {
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
    let folder = folder();
    let path = folder.path().join("paused.rrd");
    let config = Config {
        clock: ClockKind::Real,
        end: Time::MAX,
        ..Config::default()
    };
    let experiment = Experiment::new(&config).expect("experiment");
    let commands = experiment.commands();
    let recorder = recorder(&experiment, &config, &path);
    let run = thread::spawn(move || experiment.run());
    for command in [Command::Pause, Command::Resume, Command::Stop] {
        thread::sleep(Duration::from_millis(500));
        commands.send(command).expect("alive");
    }
    let outcome = run.join().expect("no panic");
    recorder.end(StopReason::of(&outcome));
    recorder.finish().expect("recorded");
    let resumed = read(&path)
        .events
        .iter()
        .find_map(|event| match event.what {
            EventKind::Applied {
                command: Command::Resume,
                ..
            } => Some(event.at),
            _ => None,
        });
    let resumed = resumed.expect("resumed").as_nanos() as i64;
    let times = wall_times(&path);
    let offset = |(wall, run): &(i64, i64)| wall - run;
    let (before, after): (Vec<_>, Vec<_>) = times.iter().partition(|(_, run)| *run <= resumed);
    let jump = after.iter().map(offset).min() > before.iter().map(offset).max();
    assert!(jump && before.len() > 10 && after.len() > 10, "{times:?}");
    let pause = offset(&after[0]) - offset(&before[0]);
    assert!(pause > 400_000_000, "a pause of {pause} ns");
}

/// A policy that has enough after some decisions.
struct Breaks(u32);

impl Policy for Breaks {
    fn name(&self) -> &str {
        "breaks"
    }

    fn act(&mut self, _: &Observation) -> Action {
        self.0 = self.0.saturating_sub(1);
        Action(if self.0 > 0 { 0.0 } else { f32::NAN })
    }
}

#[test]
fn the_recording_of_a_run_that_fails_is_complete() {
    let folder = folder();
    let path = folder.path().join("failed.rrd");
    let config = Config::default();
    let experiment = Experiment::with_policy(&config, Box::new(Breaks(10)));
    let experiment = experiment.expect("experiment");
    let recorder = recorder(&experiment, &config, &path);
    let outcome = experiment.run();
    recorder.end(StopReason::of(&outcome));
    recorder.finish().expect("recorded");
    let recording = read(&path);
    assert!(recording.is_whole());
    let said = format!("{:?}", recording.outcome);
    assert!(said.contains("must be finite"), "{said}");
    assert_eq!(recording.messages::<Action>("/action").len(), 9);
}
