//! Recording while a run is under way.

use std::{fs, path::Path, sync::Arc, thread, time::Duration};

use ratelab::{ClockKind, Command, Speed, Time, TimedCommand};
use ratelab_cart_pole::{Action, CartPole, Observation, policy::Policy};
use ratelab_study::{
    experiment::{Config, Experiment},
    system::WorldKind,
};

use crossbeam_channel::Sender;

use super::{
    assert_has, experiment, file, finish, folder, found, ms, paced, read, record, record_run,
    recorder, verify,
};
use crate::{
    Recorder, Recording, Source, StopReason,
    frames::Chunks,
    schema::node_entity,
    timeline::{RUN_TIME, WALL_TIME},
};

/// Commands that turn the knobs in `text`.
fn knobs(text: &str) -> Vec<Command> {
    let knobs = CartPole::KNOBS.parse(text).expect("a knob");
    knobs.into_iter().map(Command::from).collect()
}

/// Sends commands in groups, with a while of wall time before each.
fn send(commands: &Sender<Command>, groups: Vec<Vec<Command>>) {
    for group in groups {
        thread::sleep(Duration::from_millis(40));
        for command in group {
            commands.send(command).expect("alive");
        }
    }
}

/// `config`, without an end.
fn endless(config: Config) -> Config {
    Config {
        end: Time::MAX,
        ..config
    }
}

/// The recording of a run of `config` that got the `first` commands, then the others; it begins
/// before the run, or `late`: between the two.
fn session(config: &Config, late: bool, first: Command, groups: Vec<Vec<Command>>) -> Recording {
    let (_folder, path) = file("live.rrd");
    let experiment = experiment(config);
    let (source, commands) = (Source::of(&experiment), experiment.commands());
    let start = || Recorder::midway(&path, &source).expect("recorder");
    let early = (!late).then(start);
    let run = thread::spawn(move || experiment.run());
    send(&commands, vec![vec![first]]);
    let recorder = early.unwrap_or_else(start);
    send(&commands, groups);
    finish(recorder, &run.join().expect("no panic"));
    read(&path)
}

#[test]
fn a_recording_made_midway_comes_again_with_ticks_that_take_time_and_without() {
    let costs = CartPole::config("takes policy 30..50").expect("a knob");
    for (world, setup) in [
        (Config::default().world, Config::default().setup),
        (WorldKind::OWN, costs.setup),
    ] {
        let folder = folder();
        let path = folder.path().join("midway.rrd");
        let config = endless(paced(10.0));
        let experiment = experiment(&Config {
            world,
            setup,
            ..config
        });
        let (source, commands) = (Source::of(&experiment), experiment.commands());
        let run = thread::spawn(move || experiment.run());
        thread::sleep(Duration::from_millis(200));
        let recorder = Recorder::midway(&path, &source).expect("recorder");
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
    for late in [false, true] {
        let faster = Command::Speed(Speed::times(50.0).expect("a speed"));
        let on_to_virtual = Command::HandOver(ClockKind::Virtual);
        let files = ["send policy lqr", "send policy missing.pt", "rate nobody 3"];
        let groups = vec![
            files.into_iter().flat_map(knobs).collect(),
            [knobs("rate policy 8"), vec![on_to_virtual]].concat(),
            vec![Command::Pause, Command::Step],
            [knobs("rate sensor 90"), vec![Command::Step]].concat(),
            knobs("queue-depth 1"),
            knobs("takes policy 45"),
            knobs("offset sensor 7"),
            vec![Command::Resume, Command::Speed(Speed::REAL_TIME)],
            vec![Command::Stop],
        ];
        let recording = session(&config, late, faster, groups);
        assert_eq!(recording.defect(), None);
        assert_eq!(recording.events.len(), 17, "{:?}", recording.events);
        verify(&recording).expect("identical");
    }
}

#[test]
fn a_file_that_exists_is_not_written_to() {
    let (_folder, path) = file("mine.rrd");
    fs::write(&path, "mine").expect("written");
    let source = Source::of(&experiment(&Config::default()));
    assert!(Recorder::from_the_start(&path, &source).is_err());
    assert_eq!(fs::read_to_string(&path).expect("read"), "mine");
}

#[test]
fn a_file_that_vanishes_ends_its_recording_and_not_the_run() {
    let (_folder, path) = file("gone.rrd");
    let experiment = experiment(&paced(4.0));
    let recorder = recorder(&experiment, &path);
    fs::remove_file(&path).expect("removed");
    let outcome = experiment.run();
    assert_eq!(outcome.as_ref().expect("no fault").steps, 501);
    recorder.end(StopReason::of(&outcome));
    let error = recorder.finish().expect_err("it is gone").to_string();
    assert_has(&error, "gone.rrd");
    assert_has(&error, "gone from");
}

#[test]
fn a_file_that_took_the_place_of_a_recording_is_left_alone() {
    let (folder, path) = file("run.rrd");
    let experiment = experiment(&paced(20.0));
    let recorder = recorder(&experiment, &path);
    fs::rename(&path, folder.path().join("moved.rrd")).expect("moved");
    fs::write(&path, "mine").expect("written");
    let outcome = experiment.run();
    recorder.end(StopReason::of(&outcome));
    assert!(recorder.finish().is_err(), "it was written elsewhere");
    assert_eq!(fs::read_to_string(&path).expect("read"), "mine");
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

#[test]
fn a_run_that_saw_the_real_clock_for_a_while_comes_again() {
    let (_folder, path) = file("both.rrd");
    let mut experiment = experiment(&paced(1.0));
    let commands = [
        (100, Command::HandOver(ClockKind::Real)),
        (300, Command::Stop),
    ];
    let commands = commands.map(|(millis, command)| TimedCommand {
        at: ms(millis),
        command,
    });
    experiment.schedule(commands.into());
    record_run(experiment, &path).0.expect("no fault");
    let recording = read(&path);
    verify(&recording).expect("identical");
    let error = found(&recording, |recording| recording.threads = None);
    assert_has(&error, "for a while");
}

/// Wall times (ns) and run times of the ticks of the first node in a file.
fn wall_times(path: &Path) -> Vec<(i64, i64)> {
    let bytes = fs::read(path).expect("read");
    let mut times = Vec::new();
    for chunk in Chunks::new(&bytes) {
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
    let resumed = events.find(|event| event.applied() == Some(&Command::Resume));
    let resumed = resumed.expect("resumed").at.as_nanos() as i64;
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
    let (_folder, path) = file("failed.rrd");
    let system = CartPole::with_policy(|_| Box::new(Breaks(10)));
    let experiment = Experiment::new(Arc::new(system), &Config::default());
    let (outcome, _) = record_run(experiment.expect("experiment"), &path);
    assert!(outcome.is_err(), "it did not fail");
    let recording = read(&path);
    assert!(recording.is_whole());
    assert_has(&format!("{:?}", recording.outcome), "must be finite");
    assert_eq!(recording.messages::<Action>("/action").len(), 9);
}
