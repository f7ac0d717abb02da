//! What goes into a file comes out of it, to the bit, and rubbish comes to
//! nothing worse than a message.

use std::{fs, path::Path, sync::Arc, thread, time::Duration};

use ratelab::{
    experiment::{Config, Experiment, Knob, Summary, TimedKnob},
    policy::PolicyKind,
    runtime::{
        ClockKind, Command, Depth, Fault, Hz, RealClock, Snapshot, Speed, Time,
        telemetry::Distribution,
    },
};
use tempfile::TempDir;

use super::{Destination, Ending, ReadError, Recorder, Recording, Retold, Source, verify};

/// Numbers that look random and are the same every time (xorshift64*).
struct Dice(u64);

impl Dice {
    fn roll(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }

    fn below(&mut self, limit: usize) -> usize {
        (self.roll() % limit as u64) as usize
    }

    fn pick<T: Copy>(&mut self, values: &[T]) -> T {
        values[self.below(values.len())]
    }

    fn hz(&mut self) -> Hz {
        let hz = self.pick(&[1.0, 3.0, 5.0, 7.5, 12.5, 33.3, 50.0, 100.0, 333.0]);
        Hz::new(hz).expect("a rate")
    }

    fn knob(&mut self) -> TimedKnob {
        let knob = match self.below(4) {
            0 => Knob::ControlHz(self.hz()),
            1 => Knob::SensorHz(self.hz()),
            2 => Knob::Policy(self.pick(&PolicyKind::ALL).into()),
            _ => Knob::QueueDepth(self.depth()),
        };
        let at = Time::from_nanos(self.roll() % 4_000_000_000);
        TimedKnob { at, knob }
    }

    fn depth(&mut self) -> Depth {
        Depth::new(self.pick(&[1, 2, 7, 100])).expect("a depth")
    }

    /// Any run of a few seconds of virtual time.
    fn config(&mut self) -> Config {
        Config {
            seed: self.roll(),
            end: Time::from_nanos(1_000_000_000 + self.roll() % 4_000_000_000),
            sensor_hz: self.hz(),
            control_hz: self.hz(),
            queue_depth: self.depth(),
            policy: self.pick(&PolicyKind::ALL).into(),
            knobs: (0..self.below(5)).map(|_| self.knob()).collect(),
            ..Config::default()
        }
    }
}

fn folder() -> TempDir {
    tempfile::tempdir().expect("a folder")
}

/// Runs `config` and records it to `path`; what it came to, and what its observer
/// reads at the end.
fn record(config: &Config, path: &Path) -> (Result<Summary, Fault>, Snapshot) {
    let experiment = Experiment::new(config).expect("experiment");
    let observer = experiment.observer();
    let recorder = Recorder::from_the_start(path, &Source::of(&experiment, config));
    let recorder = recorder.expect("recorder");
    let outcome = experiment.run(&mut RealClock::default());
    recorder.end(Ending::of(&outcome));
    recorder.finish().expect("recorded");
    (outcome, observer.snapshot())
}

fn read(path: &Path) -> Recording {
    Recording::read(path).expect("a recording")
}

/// A run with knobs turned, in a file in `folder`.
fn recording(folder: &TempDir) -> Recording {
    let path = folder.path().join("run.rrd");
    let knobs = "1.5 control-hz 10\n2.25 queue-depth 3\n3 sensor-hz 75";
    let config = Config {
        seed: 4,
        end: Time::from_nanos(4_000_000_000),
        knobs: ratelab::experiment::parse_knobs(knobs).expect("knobs"),
        ..Config::default()
    };
    record(&config, &path).0.expect("no fault");
    read(&path)
}

#[test]
fn any_virtual_run_comes_again_to_the_bit() {
    let (folder, mut dice) = (folder(), Dice(1));
    for number in 0..50 {
        let path = folder.path().join(format!("{number}.rrd"));
        let config = dice.config();
        let (outcome, _) = record(&config, &path);
        let recording = read(&path);
        assert!(recording.is_whole());
        let identical = verify(&recording).unwrap_or_else(|error| panic!("{config:?}: {error}"));
        let summary = outcome.expect("no fault");
        let published = summary.obs.published + summary.action.published + summary.steps;
        assert_eq!(identical.messages as u64, published);
    }
}

#[test]
fn a_single_bit_that_differs_is_found_and_named() {
    let (folder, mut dice) = (folder(), Dice(2));
    let original = recording(&folder);
    for _ in 0..60 {
        let mut altered = original.clone();
        let topic = dice.below(altered.topics.len());
        let name = original.origin.shape.topics[topic].name.clone();
        let track = &mut altered.topics[topic];
        let index = dice.below(track.heads.len());
        let head = &mut track.heads[index];
        let bit = 1 << dice.below(64);
        match dice.below(6) {
            0 => head.seq ^= bit,
            1 => head.dropped ^= bit,
            2 => head.stamp = Time::from_nanos(head.stamp.as_nanos() ^ bit),
            _ => {
                let place = index * track.width + dice.below(track.width);
                let value = &mut track.values[place];
                *value = f64::from_bits(value.to_bits() ^ bit);
            }
        }
        let error = verify(&altered).expect_err("a difference").to_string();
        assert!(error.contains(&format!("{name} message")), "{error}");
    }
}

#[test]
fn a_message_more_or_less_is_found() {
    let folder = folder();
    let original = recording(&folder);
    for topic in 0..original.topics.len() {
        let mut short = original.clone();
        let track = &mut short.topics[topic];
        track.heads.pop();
        let error = verify(&short).expect_err("one is missing").to_string();
        assert!(
            error.contains("recorded none, computed a message"),
            "{error}"
        );
        let mut long = original.clone();
        let track = &mut long.topics[topic];
        track.heads.extend(track.heads.last().copied());
        track
            .values
            .extend_from_within(track.values.len() - track.width..);
        let error = verify(&long).expect_err("one is too many").to_string();
        assert!(
            error.contains("recorded a message, computed none"),
            "{error}"
        );
    }
}

/// All figures in a snapshot, as text.
fn figures(snapshot: &Snapshot) -> String {
    let distribution = |d: &Distribution| {
        let quantiles = [0.1, 0.5, 0.9, 0.99].map(|q| d.quantile(q));
        format!("{} {:?} {:?} {quantiles:?}", d.count(), d.sum(), d.max())
    };
    let mut text = format!("{} {:?}\n", snapshot.now, snapshot.status);
    for node in &snapshot.nodes {
        let meters = node.meters.iter();
        let meters: Vec<_> = meters.map(|m| distribution(&m.distribution)).collect();
        text += &format!(
            "{} {} {} {} {} {} {meters:?}\n",
            node.name,
            node.hz,
            node.ticks,
            node.overruns,
            distribution(&node.lateness),
            distribution(&node.tick_time),
        );
    }
    for topic in &snapshot.topics {
        let readers = topic.subscriptions.iter();
        let readers: Vec<_> = readers
            .map(|s| (s.dropped, s.dropped_lately, distribution(&s.ages)))
            .collect();
        text += &format!(
            "{} {} {} {} {:?} {readers:?}\n",
            topic.name, topic.depth, topic.published, topic.per_second, topic.newest,
        );
    }
    text
}

#[test]
fn a_run_told_again_shows_the_figures_that_the_run_showed() {
    let (folder, mut dice) = (folder(), Dice(3));
    for number in 0..20 {
        let config = Config {
            knobs: (0..3).map(|_| dice.knob()).collect(),
            ..dice.config()
        };
        let whole = folder.path().join(format!("{number}.rrd"));
        record(&config, &whole).0.expect("no fault");
        let mut retold = Retold::new(Arc::new(read(&whole)));
        // As far as the run came, and at two moments on the way.
        let last = retold.recording().until.as_nanos();
        for until in [last / 3, last / 2, last].map(Time::from_nanos) {
            let end = until.min(config.end);
            let part = folder.path().join(format!("{number}-{until}.rrd"));
            let (_, snapshot) = record(
                &Config {
                    end,
                    ..config.clone()
                },
                &part,
            );
            retold.tell(until);
            assert_eq!(
                figures(&retold.observer().snapshot()),
                figures(&snapshot),
                "{config:?} at {until}"
            );
        }
    }
}

#[test]
fn telling_again_from_the_beginning_tells_the_same() {
    let folder = folder();
    let mut retold = Retold::new(Arc::new(recording(&folder)));
    let until = Time::from_nanos(2_500_000_000);
    let steps = retold.tell(until);
    let first = figures(&retold.observer().snapshot());
    retold.tell(Time::MAX);
    retold.rewind();
    assert_eq!(retold.tell(until), steps);
    assert_eq!(figures(&retold.observer().snapshot()), first);
}

#[test]
fn a_session_with_knobs_turned_live_comes_again() {
    let folder = folder();
    let path = folder.path().join("live.rrd");
    let config = Config {
        speed: Speed::times(20.0).expect("a speed"),
        end: Time::MAX,
        ..Config::default()
    };
    let experiment = Experiment::new(&config).expect("experiment");
    let commands = experiment.commands();
    let recorder = Recorder::from_the_start(&path, &Source::of(&experiment, &config));
    let recorder = recorder.expect("recorder");
    let run = thread::spawn(move || experiment.run(&mut RealClock::default()));
    let pause = Duration::from_millis(40);
    let hz = |hz| Hz::new(hz).expect("a rate");
    for command in [
        Knob::ControlHz(hz(12.0)).commands(),
        vec![Command::Pause, Command::Step, Command::Step],
        // What no knob can do.
        vec![Command::SetRate {
            node: "actuator".to_owned(),
            hz: hz(40.0),
        }],
        vec![Command::SetDepth {
            topic: "/action".to_owned(),
            depth: Depth::ONE,
        }],
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
    recorder.end(Ending::of(&outcome));
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
        speed: Speed::times(10.0).expect("a speed"),
        ..Config::default()
    };
    let experiment = Experiment::new(&config).expect("experiment");
    let source = Source::of(&experiment, &config);
    let run = thread::spawn(move || experiment.run(&mut RealClock::default()));
    thread::sleep(Duration::from_millis(200));
    let recorder = Recorder::midway(&path, &source).expect("recorder");
    thread::sleep(Duration::from_millis(300));
    recorder.end(Ending::Off);
    let recorded = recorder.finish().expect("recorded");
    drop(source);
    run.join().expect("no panic").expect("no fault");
    let recording = read(&path);
    assert!(recording.is_whole());
    assert!(
        recording.topics[0].heads[0].seq > 0,
        "it began at the start"
    );
    let identical = verify(&recording).expect("identical");
    assert_eq!(identical.messages as u64, recorded.messages);
    assert!((100..500).contains(&identical.messages), "{identical}");
}

#[test]
fn a_real_clock_run_is_told_and_not_verified() {
    let folder = folder();
    let path = folder.path().join("real.rrd");
    let config = Config {
        clock: ClockKind::Real,
        end: Time::from_nanos(1_200_000_000),
        ..Config::default()
    };
    let (outcome, snapshot) = record(&config, &path);
    let recording = read(&path);
    let error = verify(&recording).expect_err("no two are the same");
    assert!(
        error.to_string().contains("under the real clock"),
        "{error}"
    );
    let mut retold = Retold::new(Arc::new(recording));
    retold.tell(Time::MAX);
    let told = retold.summary();
    let summary = outcome.expect("no fault");
    assert_eq!(told.end(), summary.end());
    assert_eq!((told.obs, told.action), (summary.obs, summary.action));
    for (told, node) in told.nodes.iter().zip(&snapshot.nodes) {
        assert_eq!((told.ticks, told.overruns), (node.ticks, node.overruns));
        assert_eq!(told.lateness.sum(), node.lateness.sum());
        assert_eq!(told.tick_time.sum(), node.tick_time.sum());
    }
}

/// A file as it is while it is recorded, before its batches are put together,
/// and the recording that comes of it. Batches are made by wall time: this takes
/// 2.5 s of it.
fn as_killed(path: &Path) -> (Vec<u8>, Recording) {
    let config = Config {
        speed: Speed::times(4.0).expect("a speed"),
        ..Config::default()
    };
    let experiment = Experiment::new(&config).expect("experiment");
    let recorder = Recorder::from_the_start(path, &Source::of(&experiment, &config));
    let recorder = recorder.expect("recorder");
    let outcome = experiment.run(&mut RealClock::default());
    thread::sleep(Duration::from_millis(1_100));
    let bytes = fs::read(path).expect("read");
    recorder.end(Ending::of(&outcome));
    recorder.finish().expect("recorded");
    (bytes, read(path))
}

#[test]
fn a_torn_file_is_good_up_to_its_last_batch() {
    let folder = folder();
    let path = folder.path().join("torn.rrd");
    let (whole, original) = as_killed(&path);
    let mut longest = Time::ZERO;
    for cut in (0..whole.len()).step_by(997).chain([whole.len()]) {
        fs::write(&path, &whole[..cut]).expect("written");
        let Ok(torn) = Recording::read(&path) else {
            assert_eq!(longest, Time::ZERO, "nothing of {cut} bytes is good");
            continue;
        };
        assert!(torn.until >= longest, "more bytes, less that is good");
        longest = torn.until;
        if torn.outcome.is_some() {
            continue; // Only what the viewer needs for speed is missing.
        }
        let defect = torn.defect().expect("it is torn");
        assert!(
            defect.contains(&format!("good up to {}", torn.until)),
            "{defect}"
        );
        for (torn_track, track) in torn.topics.iter().zip(&original.topics) {
            let good = track.heads.partition_point(|head| head.stamp <= torn.until);
            assert_eq!(torn_track.heads[..], track.heads[..good], "a gap at {cut}");
        }
        verify(&torn).expect("the part is identical");
    }
    assert!(longest > Time::from_nanos(8_000_000_000), "{longest}");
}

/// Reads `bytes` as a file, tells and verifies what can be read.
fn use_it(path: &Path, bytes: &[u8]) -> Result<(), ReadError> {
    fs::write(path, bytes).expect("written");
    let recording = Recording::read(path)?;
    let mut retold = Retold::new(Arc::new(recording));
    retold.tell(Time::MAX);
    let _ = retold.summary();
    // Whatever it says: it is an answer.
    let _ = verify(retold.recording());
    Ok(())
}

#[test]
fn a_thousand_damaged_files_come_to_nothing_worse_than_a_message() {
    let (folder, mut dice) = (folder(), Dice(5));
    let whole = fs::read(recording(&folder).path).expect("read");
    let path = folder.path().join("damaged.rrd");
    let mut refused = 0;
    for _ in 0..1_000 {
        let mut bytes = whole.clone();
        match dice.below(5) {
            0 => bytes.truncate(dice.below(whole.len())),
            1 => {
                let at = dice.below(bytes.len());
                bytes[at] ^= 1 << dice.below(8);
            }
            2 => {
                for _ in 0..1 + dice.below(100) {
                    let at = dice.below(bytes.len());
                    bytes[at] = dice.roll() as u8;
                }
            }
            3 => {
                let (from, to) = (dice.below(bytes.len()), dice.below(bytes.len()));
                bytes.drain(from.min(to)..from.max(to));
            }
            _ => {
                // A number that is far too large, of the kind that lengths are.
                let at = dice.below(bytes.len() - 8);
                bytes[at..at + 8].copy_from_slice(&(u64::MAX >> dice.below(64)).to_le_bytes());
            }
        }
        refused += usize::from(use_it(&path, &bytes).is_err());
    }
    assert!((100..990).contains(&refused), "{refused} were refused");
}

#[test]
fn what_is_no_recording_is_said_to_be_none() {
    let folder = folder();
    let path = folder.path().join("file");
    let foreign = [
        (&b""[..], "not a rerun recording"),
        (b"step,time_s\n1,0.0\n", "not a rerun recording"),
        (b"RRF2", "not a rerun recording"),
        (b"RRF2\0\x24\x03\0\x02\x02\0\0", "damaged at its beginning"),
    ];
    for (bytes, what) in foreign {
        let error = use_it(&path, bytes).expect_err("refused").to_string();
        assert!(error.contains(what), "{error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
    let error = Recording::read(&folder.path().join("none")).expect_err("refused");
    assert!(matches!(error, ReadError::File { .. }));
    assert!(Recording::read(folder.path()).is_err());
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
    let mut named = Destination::new(Some(path.clone()));
    assert_eq!(
        named.next(&config),
        path,
        "a name that was asked for is not changed"
    );
}

#[test]
fn a_file_that_vanishes_ends_its_recording_and_not_the_run() {
    let folder = folder();
    let path = folder.path().join("gone.rrd");
    let config = Config {
        speed: Speed::times(4.0).expect("a speed"),
        ..Config::default()
    };
    let experiment = Experiment::new(&config).expect("experiment");
    let recorder = Recorder::from_the_start(&path, &Source::of(&experiment, &config));
    let recorder = recorder.expect("recorder");
    fs::remove_file(&path).expect("removed");
    let outcome = experiment.run(&mut RealClock::default());
    assert_eq!(outcome.as_ref().expect("no fault").steps, 501);
    recorder.end(Ending::of(&outcome));
    let error = recorder.finish().expect_err("it is gone").to_string();
    assert!(
        error.contains("gone.rrd") && error.contains("gone from"),
        "{error}"
    );
}
