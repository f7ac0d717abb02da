//! Reads a recorded run from a file.

use std::{
    io,
    path::{Path, PathBuf},
    sync::Arc,
};

use ratelab::{Event, Message, Time};
use ratelab_account::{Fields, Rows, TickRecord};
use ratelab_replay::RunLog;
use ratelab_study::{
    file::{self, FileError},
    graph_file::GraphFile,
    system::System,
};
use thiserror::Error;

use super::{
    content::Content,
    frames::{Chunks, is_rrd, quietly},
    other::OtherSystem,
    schema::{Origin, RecordingEnd, SWEEP_APPLICATION},
    source::{Source, StopReason},
    thread_log::ThreadLog,
};

/// Maximum size of a file (bytes): half a day at 50 Hz. Reading takes about twice as much
/// memory.
const LARGEST: u64 = 1 << 30;

/// The reason why a file was not read.
#[derive(Debug, Error)]
pub enum ReadError {
    /// It cannot be opened.
    #[error("{}: {why}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        why: io::Error,
    },
    /// It contains curves of a sweep, and no run.
    #[error(
        "{file}: these are the curves of a sweep and no run: ratelab replay {file} opens them \
         in the rerun viewer",
        file = path.display()
    )]
    Sweep {
        /// The file.
        path: PathBuf,
    },
    /// It is of another kind, or nothing in it is readable.
    #[error("{}: {what}", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// The reason.
        what: String,
    },
}

/// A recorded run, or its readable part.
#[derive(Clone, Debug)]
pub struct Recording {
    /// The file.
    pub path: PathBuf,
    /// Its size in bytes.
    pub bytes: u64,
    /// The run.
    pub origin: Origin,
    /// The messages of the topics, in the order of the [`Topology`]; empty for topics
    /// that are not recorded.
    pub topics: Vec<Rows>,
    /// The ticks of the nodes, in the order of the [`Topology`].
    pub ticks: Vec<Vec<TickRecord>>,
    /// Commands and ends.
    pub events: Vec<Event>,
    /// What the threads of the real clock did, and in which order; `None` if the run was
    /// never under it, or the file is too old.
    pub threads: Option<ThreadLog>,
    /// Run time of the last item.
    pub until: Time,
    /// The end of the recording; `None` if the file was cut off.
    pub outcome: Option<RecordingEnd>,
    /// The defect at the end of the content, if the file is damaged.
    pub damage: Option<&'static str>,
    /// Whether its content has another digest than it had when it was recorded.
    pub altered: bool,
}

impl Recording {
    /// Reads the file at `path`, or its intact part.
    ///
    /// # Errors
    /// [`ReadError`] if it is no recording of ratelab, or no part of it is intact.
    pub fn read(path: &Path) -> Result<Self, ReadError> {
        Self::read_watched(path, |_, _| ())
    }

    /// The same; `watch` gets the bytes that are read so far, and their number in all.
    ///
    /// # Errors
    /// As of [`Self::read`].
    pub fn read_watched(path: &Path, watch: impl FnMut(u64, u64)) -> Result<Self, ReadError> {
        let bytes = read_file(path).map_err(|why| ReadError::File {
            path: path.to_owned(),
            why,
        })?;
        Self::parse(path, &bytes, watch)
    }

    fn parse(
        path: &Path,
        bytes: &[u8],
        mut watch: impl FnMut(u64, u64),
    ) -> Result<Self, ReadError> {
        let foreign = |what: &str| ReadError::Foreign {
            path: path.to_owned(),
            what: what.to_owned(),
        };
        if !is_rrd(bytes) {
            let what = "this is not a rerun recording: expected a .rrd file that ratelab made";
            return Err(foreign(what));
        }
        let mut chunks = Chunks::new(bytes);
        let mut content = Content::default();
        while let Some(chunk) = chunks.next() {
            watch((bytes.len() - chunks.left()) as u64, bytes.len() as u64);
            let added = quietly(|| Some(content.add(&chunk)));
            let added = added.unwrap_or_else(|| Err("this recording is damaged".to_owned()));
            added.map_err(|what| foreign(&what))?;
        }
        let begun = content.origin.is_some();
        if !begun && chunks.application.as_deref() == Some(SWEEP_APPLICATION) {
            let path = path.to_owned();
            return Err(ReadError::Sweep { path });
        }
        let (Some(origin), Some(until)) = (content.origin, content.until) else {
            return Err(foreign(&nothing_whole(begun, chunks.damage)));
        };
        let end = content.outcome.as_ref().map(|outcome| outcome.threads);
        let threads = content
            .threads
            .finish(&origin.topology, &content.events, end);
        let mut recording = Self {
            threads,
            path: path.to_owned(),
            bytes: bytes.len() as u64,
            topics: content.topics,
            ticks: content.ticks,
            events: content.events,
            until,
            outcome: content.outcome,
            damage: chunks.damage.or(content.damage),
            altered: content.altered,
            origin,
        };
        recording.check(content.sound);
        recording.find_ends();
        Ok(recording)
    }

    /// The run of `source` so far, without its messages and ticks: enough to execute it
    /// again. `end` is how it ended, if it did.
    pub fn of_run(source: &Source, end: &StopReason) -> Self {
        let (origin, observer) = (source.origin.clone(), &source.observer);
        let [topics, nodes] = [origin.topology.topics.len(), origin.topology.nodes.len()];
        // The events after the log, which mentions some.
        let (log, until) = (RunLog::of(observer).log(), observer.now());
        let events = observer.events(0);
        let threads = (!log.is_empty()).then(|| ThreadLog {
            log,
            events: events.clone(),
            damage: None,
        });
        Self {
            path: PathBuf::new(),
            bytes: 0,
            topics: vec![Rows::default(); topics],
            ticks: vec![Vec::new(); nodes],
            events,
            threads,
            until,
            outcome: Some(RecordingEnd {
                at: until,
                clock: observer.status().clock,
                end: end.status(&*source.system),
                messages: vec![0; topics],
                ticks: vec![0; nodes],
                lost: 0,
                dropped: end.losses(observer),
                threads: None,
                digest: None,
            }),
            damage: None,
            altered: false,
            origin,
        }
    }

    /// The same without its messages and ticks, and with none lost: to be filled again.
    pub(super) fn without_rows(&self) -> Self {
        let mut outcome = self.outcome.clone();
        if let Some(outcome) = &mut outcome {
            outcome.lost = 0;
        }
        Self {
            path: self.path.clone(),
            origin: self.origin.clone(),
            topics: vec![Rows::default(); self.topics.len()],
            ticks: vec![Vec::new(); self.ticks.len()],
            events: self.events.clone(),
            threads: self.threads.clone(),
            outcome,
            ..*self
        }
    }

    /// All messages of the topic called `name`, in order of publication.
    pub fn messages<T: Fields>(&self, name: &str) -> Vec<Message<T>> {
        let messages = self.rows(name).into_iter().flat_map(|rows| {
            let indices = 0..rows.len();
            indices.filter_map(|index| rows.message(index))
        });
        messages.collect()
    }

    /// The messages of the topic called `name`, as numbers.
    pub fn rows(&self, name: &str) -> Option<&Rows> {
        self.topic(name).map(|(_, rows)| rows)
    }

    /// The topic called `name`, and its messages as numbers.
    pub(super) fn topic(&self, name: &str) -> Option<(&str, &Rows)> {
        let names = self.origin.topology.topics.iter();
        let mut topics = names.map(|topic| &*topic.name).zip(&self.topics);
        topics.find(|(known, _)| *known == name)
    }

    /// Whether it is a recording of `system`.
    pub fn is_of(&self, system: &dyn System) -> bool {
        let Origin {
            system: name,
            graph_file,
            ..
        } = &self.origin;
        name == system.name() && graph_file.as_deref() == system.about().graph_file
    }

    /// The system of its graph file, which may have `system` in the middle; `None` without an
    /// intact one.
    pub fn graph_system(&self, system: &Arc<dyn System>) -> Option<Arc<dyn System>> {
        let graph = GraphFile::parse(self.origin.graph_file.as_ref()?).ok()?;
        Some(Arc::new(graph.system(std::slice::from_ref(system)).ok()?))
    }

    /// The system of the recording: `system` if it is the same, or else a placeholder
    /// with the data of the file.
    pub fn system(&self, system: &Arc<dyn System>) -> Arc<dyn System> {
        if self.is_of(&**system) {
            system.clone()
        } else {
            Arc::new(OtherSystem)
        }
    }

    /// Whether the file is complete and undamaged.
    pub fn is_whole(&self) -> bool {
        self.damage.is_none() && self.outcome.is_some()
    }

    /// The defect of the file; `None` if it is whole.
    pub fn defect(&self) -> Option<String> {
        if self.is_whole() {
            return None;
        }
        let why = self.damage.unwrap_or("its end is missing");
        Some(format!(
            "this file is good up to {} only: {why}",
            self.until
        ))
    }
}

/// The reason why no part of a file is intact, although it begins like a recording;
/// `begun` if it contains the description of the run.
fn nothing_whole(begun: bool, damage: Option<&str>) -> String {
    match (begun, damage) {
        (true, Some(damage)) => format!("nothing in this recording is whole: {damage}"),
        (true, None) => "this recording ends before anything in it is whole".to_owned(),
        (false, Some(damage)) => format!("this recording is damaged at its beginning: {damage}"),
        (false, None) => "this is a rerun recording, but not one that ratelab made".to_owned(),
    }
}

fn read_file(path: &Path) -> io::Result<Vec<u8>> {
    file::read(path, LARGEST).map_err(|error| match error {
        FileError::Unreadable(why) => why,
        FileError::NoFile(_) => io::Error::other("this is not a file"),
        FileError::TooLarge(_) => io::Error::other(format!(
            "this file is longer than what is read, {LARGEST} bytes"
        )),
    })
}
