//! What goes into a file comes out of it, to the bit, and rubbish comes to
//! nothing worse than a message.

mod altered;
#[path = "../../../../tests/support/cells.rs"]
mod cells;
mod curves;
mod damage;
mod destination;
mod given;
mod lanes;
mod leaks;
mod lies;
mod live;
mod own;
mod publishers;
mod replayed;
mod scene;
mod schedule;
mod sealed;
#[path = "../../../../tests/support/table.rs"]
mod table;
mod texts;
mod threads;
mod timeline;
mod verified;

use std::{
    ops::ControlFlow,
    path::{Path, PathBuf},
    sync::Arc,
};

use ratelab::{ClockKind, Event, EventKind, Fault, Head, Hz, Knob, Speed, Time};
use ratelab_cart_pole::{CartPole, policy::PolicyKind};
use ratelab_experiment::{Config, Experiment, Summary};
use ratelab_metrics::Snapshot;
use ratelab_recording::{
    Destination, FinishedRecording, Identical, Recorder, Recording, Replay, RrdFormat, Source,
    StopReason, VerifyError, VerifyWith, rrd::timeline::BatchStream,
};
use ratelab_system::{BuildError, Builder, System};
use rerun::{
    RecordingStream, RecordingStreamBuilder,
    external::re_log_encoding::DecoderApp,
    log::{Chunk, LogMsg},
    sink::MemorySinkStorage,
};
use tempfile::TempDir;

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

    fn hz(&mut self) -> f64 {
        self.pick(&[1.0, 3.0, 5.0, 7.5, 12.5, 33.3, 50.0, 100.0, 333.0])
    }

    /// A knob of the cart-pole as text.
    fn knob(&mut self) -> String {
        match self.below(4) {
            0 => format!("control-hz {}", self.hz()),
            1 => format!("sensor-hz {}", self.hz()),
            2 => format!("policy {}", self.pick(&PolicyKind::ALL)),
            _ => format!("queue-depth {}", self.pick(&[1, 2, 7, 100])),
        }
    }

    /// Lines of `count` knobs.
    fn knobs(&mut self, count: usize) -> String {
        let mut line = || {
            let at = Time::from_nanos(self.roll() % 4_000_000_000);
            format!("{} {}\n", at.as_secs_f64(), self.knob())
        };
        (0..count).map(|_| line()).collect()
    }

    /// Any run of a few seconds of virtual time.
    fn config(&mut self) -> Config {
        let setup = [self.knob(), self.knob(), self.knob(), self.knob()].join(", ");
        let count = self.below(5);
        Config {
            seed: self.roll(),
            end: Time::from_nanos(1_000_000_000 + self.roll() % 4_000_000_000),
            ..with_knobs(&setup, &self.knobs(count))
        }
    }
}

/// Ten seconds of the cart-pole, set up by `setup` and turned by `knobs`.
fn with_knobs(setup: &str, knobs: &str) -> Config {
    Config {
        knobs: CartPole::KNOBS.parse_list(knobs).expect("knobs"),
        ..CartPole::config(setup).expect("a setup")
    }
}

/// A system with this name, made by a function.
struct Made<B>(&'static str, B);

impl<B> System for Made<B>
where
    B: Fn(&mut Builder<'_>) -> Result<(), BuildError> + Send + Sync + 'static,
{
    fn name(&self) -> &str {
        self.0
    }

    fn build(&self, builder: &mut Builder<'_>) -> Result<(), BuildError> {
        (self.1)(builder)
    }
}

/// The cart-pole.
fn cart_pole() -> Arc<dyn System> {
    Arc::new(CartPole::default())
}

/// A run of the cart-pole.
fn experiment(config: &Config) -> Experiment {
    Experiment::new(cart_pole(), config).expect("experiment")
}

fn folder() -> TempDir {
    tempfile::tempdir().expect("a folder")
}

/// The path of a file `name` in a folder of its own.
fn file(name: &str) -> (TempDir, PathBuf) {
    let folder = folder();
    let path = folder.path().join(name);
    (folder, path)
}

/// Runs `config` and records it to `path`; the summary, and what its observer
/// reads at the end.
fn record(config: &Config, path: &Path) -> (Result<Summary, Fault>, Snapshot) {
    record_run(experiment(config), path)
}

/// Runs `experiment` and records it to `path`.
fn record_run(experiment: Experiment, path: &Path) -> (Result<Summary, Fault>, Snapshot) {
    let observer = experiment.observer();
    let recorder = recorder(&experiment, path);
    let outcome = experiment.run();
    finish(recorder, &outcome);
    (outcome, observer.snapshot())
}

/// What became of the messages of each topic of a run.
fn traffic(summary: &Summary) -> Vec<(String, [u64; 5], f64, bool)> {
    let topics = summary.topics.iter().map(|topic| {
        let counts = [
            topic.published,
            topic.dropped(),
            topic.lost,
            topic.overtaken,
            topic.in_flight(),
        ];
        let average = topic.average(summary.sim_time);
        (topic.name.to_string(), counts, average, topic.is_read())
    });
    topics.collect()
}

/// Ends a recording with its run.
fn finish(recorder: Recorder, outcome: &Result<Summary, Fault>) -> FinishedRecording {
    recorder.end(StopReason::from_outcome(outcome));
    recorder.finish().expect("recorded")
}

/// The recording of a run of `config`, and its summary.
fn recorded(config: &Config) -> (Recording, Summary) {
    let (_folder, path) = file("run.rrd");
    let summary = record(config, &path).0.expect("no fault");
    (read(&path), summary)
}

/// What a verification finds in `original` after `lie`.
fn found(original: &Recording, lie: impl FnOnce(&mut Recording)) -> String {
    let mut altered = original.clone();
    lie(&mut altered);
    verify(&altered).expect_err("a lie").to_string()
}

/// Checks that `part` is in `text`.
#[track_caller]
fn assert_has(text: &str, part: &str) {
    assert!(text.contains(part), "{part:?} is not in {text}");
}

/// Runs a recording of the cart-pole again, unwatched.
fn verify(recording: &Recording) -> Result<Identical, VerifyError> {
    verify_with(recording, &cart_pole())
}

/// Runs it again with `system`, unwatched.
fn verify_with(recording: &Recording, system: &Arc<dyn System>) -> Result<Identical, VerifyError> {
    ratelab_recording::verify(recording, system, VerifyWith::default(), |_| {
        ControlFlow::Continue(())
    })
}

/// A replay at the end of a recording of the cart-pole.
fn replayed(recording: Recording) -> Replay {
    replayed_with(recording, &cart_pole())
}

/// A replay at its end, by `system`.
fn replayed_with(recording: Recording, system: &Arc<dyn System>) -> Replay {
    let mut replay = Replay::new(Arc::new(recording), system);
    replay.advance_to(Time::MAX);
    replay
}

/// A recording of the cart-pole, to be replayed.
fn replay(recording: Recording) -> Replay {
    Replay::new(Arc::new(recording), &cart_pole())
}

fn read(path: &Path) -> Recording {
    Recording::read(path).expect("a recording")
}

/// A run with knobs turned, in a file in `folder`.
fn recording(folder: &TempDir) -> Recording {
    let path = folder.path().join("run.rrd");
    record(&turned(), &path).0.expect("no fault");
    read(&path)
}

/// Four seconds with knobs turned.
fn turned() -> Config {
    Config {
        seed: 4,
        end: ms(4_000),
        ..with_knobs("", "1.5 control-hz 10\n2.25 queue-depth 3\n3 sensor-hz 75")
    }
}

/// A run with a fall, after 0.84 s.
fn falling() -> Config {
    with_knobs("control-hz 5", "")
}

/// Runs paced at `factor` times the wall's speed.
fn paced(factor: f64) -> Config {
    Config {
        speed: Speed::times(factor).expect("a speed"),
        ..Config::default()
    }
}

/// A run of the real clock up to `end`.
fn real(end: Time) -> Config {
    Config {
        clock: ClockKind::Real,
        speed: Speed::REAL_TIME,
        end,
        ..Config::default()
    }
}

/// A destination of rerun's files at `path`.
fn to(path: &Path) -> Destination {
    Destination::new(Some(path.to_owned()), RrdFormat::default())
}

/// Begins to record `experiment` to `path`.
fn recorder(experiment: &Experiment, path: &Path) -> Recorder {
    let recorder = Recorder::from_the_start(&mut to(path), &Source::for_experiment(experiment));
    recorder.expect("a recorder")
}

/// The rate of `node` was turned to `rate` at run time `at`.
fn turned_rate(at: Time, node: &str, rate: f64) -> Event {
    let (node, hz) = (node.to_owned(), hz(rate));
    let what = EventKind::Applied {
        command: Knob::Rate { node, hz }.into(),
        was: None,
    };
    Event { at, what }
}

/// A rate.
fn hz(hz: f64) -> Hz {
    Hz::new(hz).expect("a rate")
}

/// A run time.
fn ms(ms: u64) -> Time {
    Time::from_nanos(ms * 1_000_000)
}

/// A stream of the recorder into memory.
fn stream() -> (RecordingStream, MemorySinkStorage) {
    let stream = RecordingStreamBuilder::new("ratelab").memory();
    stream.expect("a stream")
}

/// The stream with a batch of a run in virtual time: its `steps`, `before` of them before it.
fn batch_stream<'a>(rec: &RecordingStream, before: u64, steps: &'a [Head]) -> BatchStream<'a> {
    BatchStream {
        rec: rec.clone(),
        epoch: None,
        before,
        steps,
    }
}

/// The chunks among `messages`.
fn chunks(messages: &[LogMsg]) -> impl Iterator<Item = Chunk> {
    let tables = messages.iter().filter_map(|message| match message {
        LogMsg::ArrowMsg(_, data) => Some(data),
        _ => None,
    });
    tables.map(|data| Chunk::from_arrow_msg(data).expect("a chunk"))
}

/// The chunks in a file, as rerun reads them.
fn chunks_of(path: &Path) -> Vec<Chunk> {
    let bytes = std::fs::read(path).expect("read");
    let messages = DecoderApp::decode_eager(&*bytes).expect("a file of rerun's");
    let messages: Vec<_> = messages.map(|message| message.expect("whole")).collect();
    chunks(&messages).collect()
}
