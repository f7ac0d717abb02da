//! What goes into a file comes out of it, to the bit, and rubbish comes to
//! nothing worse than a message.

mod altered;
mod damage;
mod lies;
mod live;
mod replayed;
mod verified;

use std::{ops::ControlFlow, path::Path};

use ratelab::{
    experiment::{Config, Experiment, Knob, Summary, TimedKnob, parse_knobs},
    policy::PolicyKind,
    runtime::{Depth, Fault, Hz, Snapshot, Speed, Time},
};
use tempfile::TempDir;

use super::{Recorder, Recording, Source, StopReason, VerifyError, verify::Identical};

/// How many cases a test over random ones tries: `usual`, or as many as
/// `RATELAB_CASES` asks for.
fn cases(usual: usize) -> usize {
    let asked = std::env::var("RATELAB_CASES").ok();
    asked.and_then(|cases| cases.parse().ok()).unwrap_or(usual)
}

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
    let outcome = experiment.run();
    recorder.end(StopReason::of(&outcome));
    recorder.finish().expect("recorded");
    (outcome, observer.snapshot())
}

/// Runs it again, unwatched.
fn verify(recording: &Recording) -> Result<Identical, VerifyError> {
    super::verify(recording, |_| ControlFlow::Continue(()))
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
        knobs: parse_knobs(knobs).expect("knobs"),
        ..Config::default()
    };
    record(&config, &path).0.expect("no fault");
    read(&path)
}

/// Runs paced at `factor` times the wall's speed.
fn paced(factor: f64) -> Config {
    Config {
        speed: Speed::times(factor).expect("a speed"),
        ..Config::default()
    }
}

/// Begins to record `experiment`, made from `config`, to `path`.
fn recorder(experiment: &Experiment, config: &Config, path: &Path) -> Recorder {
    let recorder = Recorder::from_the_start(path, &Source::of(experiment, config));
    recorder.expect("a recorder")
}
