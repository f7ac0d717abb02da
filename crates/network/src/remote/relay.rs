//! The run of other processes for recorders, and their recordings.

use std::path::PathBuf;

use ratelab::{Head, Topology};
use ratelab_experiment::{Summary, Taps};
use ratelab_metrics::{Copies, RunRow, Tap, TickRecord};
use ratelab_recording::{
    Destination, FinishedRecording, RecordError, Recorder, Source, StopReason, Tapped,
};

/// Passes on messages and ticks to whoever taps them.
pub struct Relay {
    topics: Vec<RelayedTopic>,
    /// Number of nodes.
    nodes: usize,
    rows: Copies<RunRow>,
}

struct RelayedTopic {
    name: String,
    /// `None` for a topic that is not recorded.
    fields: Option<Vec<String>>,
}

impl Relay {
    /// Creates a relay for a graph with this `topology`, of which the topics that are `known` are
    /// recorded.
    pub fn new(topology: &Topology, known: &Taps) -> Self {
        let topics = topology.topics.iter().map(|topic| RelayedTopic {
            fields: known.fields(&topic.name).map(<[String]>::to_vec),
            name: topic.name.clone(),
        });
        Self {
            topics: topics.collect(),
            nodes: topology.nodes.len(),
            rows: Copies::default(),
        }
    }

    /// Passes on a message of the topic with index `topic`, and that some are `missing`
    /// before it.
    pub fn message(&self, topic: usize, head: Head, row: &[f64], missing: u64) {
        let known = self.topics.get(topic);
        if known.is_some_and(|topic| topic.fields.is_some()) {
            self.pass(RunRow::Message(topic, head, row.to_vec()), missing);
        }
    }

    /// Passes on a tick of the node with index `node`, and that some are `missing` before
    /// it.
    pub fn tick(&self, node: usize, tick: TickRecord, missing: u64) {
        if node < self.nodes {
            self.pass(RunRow::Tick(node, tick), missing);
        }
    }

    fn pass(&self, row: RunRow, missing: u64) {
        self.rows.lose(missing);
        self.rows.offer(&row);
    }
}

impl Tapped for Relay {
    fn fields(&self, topic: &str) -> Option<&[String]> {
        self.topics
            .iter()
            .find(|known| known.name == topic)?
            .fields
            .as_deref()
    }

    fn all(&self, capacity: usize) -> Tap<RunRow> {
        self.rows.tap(capacity)
    }
}

/// The recordings so far.
#[derive(Default)]
pub struct Recordings {
    destination: Destination,
    /// Whether runs are recorded.
    on: bool,
    present: Option<Recorder>,
    done: Vec<Recorder>,
    /// The first file that could not be made.
    refused: Option<RecordError>,
    /// The summary of the last run, and whether that run ended.
    pub last: Option<(Summary, bool)>,
}

impl Recordings {
    /// Creates an empty list; later runs are recorded to `destination`, unless that is `None`.
    pub fn new(destination: Option<Destination>) -> Self {
        Self {
            on: destination.is_some(),
            destination: destination.unwrap_or_default(),
            ..Self::default()
        }
    }

    /// Records the run of `source` from now on.
    ///
    /// # Errors
    /// [`RecordError`] if the file cannot be made.
    pub fn begin(&mut self, source: Source) -> Result<PathBuf, RecordError> {
        let begun = Recorder::from_the_start(&mut self.destination, &source);
        self.on = begun.is_ok();
        let recorder = self.present.insert(begun?);
        Ok(recorder.path().to_owned())
    }

    /// Records a run that just began; an error waits for the end.
    pub fn begin_of_run(&mut self, source: Source) {
        if let Err(why) = self.begin(source) {
            self.refused.get_or_insert(why);
        }
    }

    /// Ends the present recording; later runs are recorded as before.
    pub fn end(&mut self, reason: StopReason) {
        if let Some(recorder) = self.present.take() {
            recorder.end(reason);
            self.done.push(recorder);
        }
    }

    /// Begins a recording of `source`, or ends the present one; returns a notice.
    pub fn toggle(&mut self, source: Source) -> String {
        if self.present.is_some() {
            self.end(StopReason::Off);
            self.on = false;
            return "the recording ends".to_owned();
        }
        match self.begin(source) {
            Ok(path) => format!("recording to {}", path.display()),
            Err(RecordError { path, why }) => format!("cannot record to {}: {why}", path.display()),
        }
    }

    /// Returns whether a run should be recorded that is not.
    pub fn is_waiting(&self) -> bool {
        self.present.is_none() && self.on
    }

    /// Returns the number of messages and ticks that the present recording lost; `None` without one.
    pub fn lost(&self) -> Option<u64> {
        self.present.as_ref().map(Recorder::lost)
    }

    /// Waits for all recordings that have ended.
    ///
    /// # Errors
    /// [`RecordError`] for a file that could not be made.
    pub fn finish(&mut self) -> Result<Vec<Result<FinishedRecording, RecordError>>, RecordError> {
        let done = std::mem::take(&mut self.done)
            .into_iter()
            .map(Recorder::finish)
            .collect();
        self.refused.take().map_or(Ok(done), Err)
    }
}
