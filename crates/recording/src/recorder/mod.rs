//! What a recorder of any format needs: a thread, a run to record, and a place for the file.
//!
//! A format of your own has a [`RecordingFormat`], which makes files, and a [`RunWriter`], which
//! writes a run to one. Replay and `verify` read rerun's only. Here a run becomes lines of text:
//!
//! ```
//! use std::{fs, fs::File, io, io::Write, path::{Path, PathBuf}, sync::Arc};
//!
//! use ratelab::Topology;
//! use ratelab_metrics::{Observer, RunRow, Tap};
//! use ratelab_cart_pole::CartPole;
//! use ratelab_recording::{
//!     BeginRun, Destination, FinishedRecording, Recorder, RecordingFormat, RunWriter, Source,
//!     StopReason,
//! };
//! use ratelab_re_execution::RunLog;
//! use ratelab_experiment::{Config, Experiment};
//!
//! struct TextFormat;
//!
//! impl RecordingFormat for TextFormat {
//!     fn extension(&self) -> &'static str {
//!         "txt"
//!     }
//!
//!     fn create(&self, path: &Path) -> io::Result<BeginRun> {
//!         let (path, file) = (path.to_owned(), File::create_new(path)?);
//!         Ok(Box::new(|source| {
//!             let (graph, observer) = (source.origin.topology, source.observer);
//!             Ok(Box::new(TextWriter { path, file, graph, observer, messages: 0 }))
//!         }))
//!     }
//! }
//!
//! struct TextWriter {
//!     path: PathBuf,
//!     file: File,
//!     graph: Topology,
//!     observer: Observer,
//!     messages: u64,
//! }
//!
//! impl RunWriter for TextWriter {
//!     fn look(&mut self, tap: &Tap<RunRow>) -> io::Result<bool> {
//!         for row in tap.items().try_iter() {
//!             match row {
//!                 RunRow::Message(topic, head, numbers) => {
//!                     self.messages += 1;
//!                     let name = &self.graph.topics[topic].name;
//!                     writeln!(self.file, "{} {name} {} {numbers:?}", head.at, head.seq)?;
//!                 }
//!                 RunRow::Tick(node, tick) => {
//!                     let name = &self.graph.nodes[node].name;
//!                     writeln!(self.file, "{} {name} tick {}", tick.at, tick.number)?;
//!                 }
//!             }
//!         }
//!         Ok(false)
//!     }
//!
//!     fn complete(
//!         mut self: Box<Self>,
//!         tap: Tap<RunRow>,
//!         _: &StopReason,
//!     ) -> io::Result<FinishedRecording> {
//!         self.look(&tap)?;
//!         Ok(FinishedRecording {
//!             path: self.path,
//!             bytes: self.file.metadata()?.len(),
//!             messages: self.messages,
//!             lost: tap.lost(),
//!             written_from_outside: RunLog::attach(&self.observer).written_from_outside(),
//!             hurried: false,
//!         })
//!     }
//! }
//!
//! let experiment = Experiment::new(Arc::new(CartPole::default()), &Config::default())?;
//! let source = Source::for_experiment(&experiment);
//! let folder = tempfile::tempdir()?;
//! let mut destination = Destination::new(Some(folder.path().to_owned()), TextFormat);
//! let recorder = Recorder::from_the_start(&mut destination, &source)?;
//! let outcome = experiment.run();
//! recorder.end(StopReason::from_outcome(&outcome));
//! let recorded = recorder.finish()?;
//!
//! let text = fs::read_to_string(&recorded.path)?;
//! let (messages, ticks): (Vec<_>, Vec<_>) = text.lines().partition(|line| line.contains(" /"));
//! assert_eq!(recorded.messages, messages.len() as u64);
//! let summary = outcome?;
//! let ticked: u64 = summary.nodes.iter().map(|node| node.ticks).sum();
//! assert_eq!(ticks.len() as u64, ticked);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod thread;

use std::{
    io,
    path::{Path, PathBuf},
    sync::Arc,
};

use ratelab::{Fault, Topology};
use ratelab_experiment::{Experiment, Summary, Taps};
use ratelab_metrics::{Observer, Rows, RunRow, Snapshot, Tap, TopicAccount};
use ratelab_re_execution::RunLog;
use ratelab_system::System;
use thiserror::Error;

pub use thread::{BACKLOG, Recorder};

use crate::run::{Origin, Recording, RecordingEnd, RunResult, RunRows, RunStatus, ThreadLog};

/// A format of recordings.
pub trait RecordingFormat: Send + Sync {
    /// Returns the extension of its files, such as `rrd`.
    fn extension(&self) -> &'static str;

    /// Creates the file `path`, which must be new, on the thread of the caller.
    ///
    /// # Errors
    /// The system's error for the file.
    fn create(&self, path: &Path) -> io::Result<BeginRun>;
}

/// Writes the beginning of a run to a new file, on the thread of the recorder. The writer must not keep
/// [`Source::taps`]: that would keep other taps of the run open.
pub type BeginRun = Box<dyn FnOnce(Source) -> io::Result<Box<dyn RunWriter>> + Send>;

/// Writes a run to its file.
pub trait RunWriter {
    /// Takes the rows that are in `tap`, a few times a second. Returns whether there were so
    /// many that it should be called again at once.
    ///
    /// # Errors
    /// An error ends the recording.
    fn look(&mut self, tap: &Tap<RunRow>) -> io::Result<bool>;

    /// Writes the remaining rows and the end. Until `tap` is dropped the run may wait for it.
    ///
    /// # Errors
    /// The first error of the file.
    fn complete(
        self: Box<Self>,
        tap: Tap<RunRow>,
        reason: &StopReason,
    ) -> io::Result<FinishedRecording>;
}

/// A recording that did not begin, or ended early.
#[derive(Debug, Error)]
#[error("the recording {} ended early: {why}", path.display())]
pub struct RecordError {
    /// The file; what is written of it is intact up to its last second.
    pub path: PathBuf,
    /// The error of the operating system.
    pub why: io::Error,
}

/// A complete recording.
#[derive(Clone, Debug)]
pub struct FinishedRecording {
    /// The file.
    pub path: PathBuf,
    /// Its size in bytes.
    pub bytes: u64,
    /// Number of messages.
    pub messages: u64,
    /// Number of messages and ticks lost because the recorder was too slow.
    pub lost: u64,
    /// What threads outside of the graph wrote to, so that the run cannot come back.
    pub written_from_outside: Vec<Arc<str>>,
    /// Whether something only for viewing was left out because the end was overdue.
    pub hurried: bool,
}

impl FinishedRecording {
    /// Returns why `verify` will refuse the recording, if it will.
    pub fn defect(&self) -> Option<String> {
        let names = &self.written_from_outside;
        (!names.is_empty()).then(|| outside(&names.join(" and ")))
    }
}

/// Returns the notice that a thread outside of the graph wrote to `name`.
pub fn outside(name: &str) -> String {
    format!(
        "a thread outside of the graph wrote to {name}: verify will refuse a recording of this run"
    )
}

/// Default folder of recordings.
const FOLDER: &str = "recordings";

/// The destination of recordings: a file name, a folder, or the folder `recordings`.
/// Existing files are never written to.
#[derive(Clone)]
pub struct Destination {
    named: Option<PathBuf>,
    /// Whether the name has been used.
    used: bool,
    format: Arc<dyn RecordingFormat>,
}

impl Destination {
    /// Creates a destination of files of this `format` at `place`, a new file or an existing
    /// folder; by default in `recordings`.
    pub fn new(place: Option<PathBuf>, format: impl RecordingFormat + 'static) -> Self {
        Self {
            named: place,
            used: false,
            format: Arc::new(format),
        }
    }

    /// Creates the file for a recording of the run of `origin`. A default name, or one already
    /// used by this destination, gets a number until it is free.
    ///
    /// # Errors
    /// The system's error for the file.
    pub fn create(&mut self, origin: &Origin) -> Result<(PathBuf, BeginRun), RecordError> {
        let (first, chosen) = self.first(origin);
        let mut number = 1;
        loop {
            let path = numbered(&first, number);
            match self.format.create(&path) {
                Ok(begin) => return Ok((path, begin)),
                // Another program may have created it first.
                Err(error) if !chosen && path.is_file() && is_taken(&error) => number += 1,
                Err(why) => return Err(RecordError { path, why }),
            }
        }
    }

    /// Returns the first name to try, and whether the user chose it, so that it must not be
    /// changed.
    fn first(&mut self, origin: &Origin) -> (PathBuf, bool) {
        match &self.named {
            Some(folder) if folder.is_dir() => (folder.join(self.name(origin)), false),
            Some(file) => (file.clone(), !std::mem::replace(&mut self.used, true)),
            None => (Path::new(FOLDER).join(self.name(origin)), false),
        }
    }

    /// Returns a name from the start time and the run, such as
    /// `2026-03-14T15-09-26_cart-pole_virtual_seed0.rrd`.
    fn name(&self, origin: &Origin) -> String {
        let now = jiff::Zoned::now().strftime("%Y-%m-%dT%H-%M-%S");
        let Origin { system, config, .. } = origin;
        let safe_name = system.replace(|c: char| !c.is_alphanumeric(), "-");
        let run = format!("{now}_{safe_name}_{}_seed{}", config.clock, config.seed);
        format!("{run}.{}", self.format.extension())
    }
}

fn is_taken(error: &io::Error) -> bool {
    error.kind() == io::ErrorKind::AlreadyExists
}

/// Returns `file` with `number` before its extension; the first one has no number.
fn numbered(file: &Path, number: u32) -> PathBuf {
    if number < 2 {
        return file.to_owned();
    }
    let mut name = file.file_stem().unwrap_or_default().to_owned();
    name.push(format!("-{number}"));
    if let Some(extension) = file.extension() {
        name.push(".");
        name.push(extension);
    }
    file.with_file_name(name)
}

/// A run whose messages and ticks can be copied: one of this process, or one that is
/// received from others.
pub trait Tapped: Send + Sync {
    /// Returns the names of the numbers in a message of the topic called `topic`; `None` if it is not
    /// recorded.
    fn fields(&self, topic: &str) -> Option<&[String]>;

    /// Returns all messages of recorded topics and all ticks from now on, in a queue of `capacity`.
    fn all(&self, capacity: usize) -> Tap<RunRow>;

    /// Room for the rows of a graph with this `topology`, each message with as many numbers as
    /// its topic has names for.
    fn empty_rows(&self, topology: &Topology) -> RunRows {
        let topics = topology.topics.iter();
        let widths = topics.map(|topic| self.fields(&topic.name).unwrap_or_default().len());
        RunRows {
            topics: widths.map(Rows::new).collect(),
            ..RunRows::empty(topology)
        }
    }
}

impl Tapped for Taps {
    fn fields(&self, topic: &str) -> Option<&[String]> {
        self.topics()
            .iter()
            .find(|known| known.name() == topic)
            .map(|known| known.fields())
    }

    fn all(&self, capacity: usize) -> Tap<RunRow> {
        self.all(capacity)
    }
}

/// A run, for a recorder.
#[derive(Clone)]
pub struct Source {
    /// The system.
    pub system: Arc<dyn System>,
    /// The origin of the run.
    pub origin: Origin,
    /// The graph before the run.
    pub start: Snapshot,
    /// Reads the graph.
    pub observer: Observer,
    /// Its messages and ticks.
    pub taps: Arc<dyn Tapped>,
    /// Prints a notice about the run while it is recorded, where nothing else shows it.
    pub notice: fn(&str),
}

impl Source {
    /// Creates the source for an experiment that has not begun.
    pub fn for_experiment(experiment: &Experiment) -> Self {
        let (system, observer) = (experiment.system().clone(), experiment.observer());
        let config = experiment.config().clone();
        Self {
            origin: Origin::new(&*system, config, observer.topology()),
            start: observer.snapshot(),
            taps: Arc::new(experiment.taps()),
            observer,
            system,
            notice: |_| {},
        }
    }

    /// Returns the run so far as a recording without messages and ticks: enough to execute it
    /// again. `end` is how it ended, if it did.
    pub fn so_far(&self, end: &StopReason) -> Recording {
        // The events after the log, which mentions some.
        let log = RunLog::attach(&self.observer).log();
        let outcome = end.end(&*self.system, &self.observer);
        let events = self.observer.events(0);
        let threads = (!log.is_empty()).then(|| ThreadLog {
            log,
            events: events.clone(),
            damage: None,
        });
        Recording {
            events,
            threads,
            until: outcome.at,
            outcome: Some(outcome),
            ..Recording::empty(self.origin.clone())
        }
    }

    /// Returns whether the plant has a picture. Before the run this is tested with a state of
    /// zeros.
    pub(crate) fn has_picture(&self) -> bool {
        let fields = self
            .system
            .states_topic()
            .and_then(|state| self.taps.fields(state));
        let zeros = fields.map(|fields| vec![0.0; fields.len()]);
        zeros.is_some_and(|zeros| self.system.robot().picture(&zeros).is_some())
    }
}

/// The reason for the end of a recording.
pub enum StopReason {
    /// The run ended.
    Run(Box<Summary>),
    /// A node failed.
    Fault(String),
    /// The recording was switched off; the run goes on.
    Off,
}

impl StopReason {
    /// Creates the reason of the end from the outcome of a run.
    pub fn from_outcome(outcome: &Result<Summary, Fault>) -> Self {
        match outcome {
            Ok(summary) => Self::Run(Box::new(summary.clone())),
            Err(fault) => Self::Fault(fault.to_string()),
        }
    }

    /// Returns the end of a run of `system` for this reason, without what is in the file.
    pub(crate) fn end(&self, system: &dyn System, observer: &Observer) -> RecordingEnd {
        let topics = observer.snapshot().topics;
        let ended = !matches!(self, Self::Off);
        let in_all =
            |count: fn(&TopicAccount) -> u64| ended.then(|| topics.iter().map(count).collect());
        RecordingEnd {
            at: observer.now(),
            clock: observer.status().clock,
            end: match self {
                Self::Run(summary) => RunStatus::Ended(RunResult::new(system, summary)),
                Self::Fault(fault) => RunStatus::Failed {
                    fault: fault.clone(),
                },
                Self::Off => RunStatus::WentOn,
            },
            messages: Vec::new(),
            ticks: Vec::new(),
            lost: 0,
            dropped: in_all(TopicAccount::dropped),
            unmatched: in_all(TopicAccount::unmatched),
            threads: None,
            digest: None,
        }
    }
}
