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

mod format;
mod source;
mod thread;

pub use format::{
    BeginRun, Destination, FinishedRecording, RecordError, RecordingFormat, RunWriter, outside,
};
pub use source::{Source, StopReason, Tapped};
pub use thread::{BACKLOG, Recorder};
