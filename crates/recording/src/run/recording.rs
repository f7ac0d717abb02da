//! A recorded run.

use std::{
    ops::{Deref, DerefMut},
    path::PathBuf,
    sync::Arc,
};

use ratelab::{Event, Message, NodeTopology, Time};
use ratelab_metrics::{Fields, Rows, TickRecord};
use ratelab_re_execution::Log;
use ratelab_system::{BuildError, Builder, System, graph_file::GraphFile};

use super::{
    origin::{Origin, RecordingEnd, RunResult, RunStatus},
    series::RunRows,
};

/// A recorded run, or its readable part.
#[derive(Clone, Debug)]
pub struct Recording {
    /// The file.
    pub path: PathBuf,
    /// Its size in bytes.
    pub bytes: u64,
    /// The run.
    pub origin: Origin,
    /// Its messages and ticks, which can be had of the recording itself.
    pub run: RunRows,
    /// The names of the numbers in a message of each topic, with their units; empty where the file
    /// has none.
    pub fields: Vec<Vec<String>>,
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

/// The log of the threads of the real clock, as it was recorded.
#[derive(Clone, Debug)]
pub struct ThreadLog {
    /// The log.
    pub log: Log,
    /// All events of the file: a damaged file may have more events than its
    /// [`Recording`].
    pub events: Vec<Event>,
    /// What is wrong with it, if anything is.
    pub damage: Option<&'static str>,
}

impl Recording {
    /// Creates a recording of the run of `origin` without anything in it.
    pub(crate) fn empty(origin: Origin) -> Self {
        Self {
            path: PathBuf::new(),
            bytes: 0,
            run: RunRows::empty(&origin.topology),
            fields: vec![Vec::new(); origin.topology.topics.len()],
            origin,
            events: Vec::new(),
            threads: None,
            until: Time::ZERO,
            outcome: None,
            damage: None,
            altered: false,
        }
    }

    /// This recording with all rows of its run, and none lost.
    pub(crate) fn with_rows(&self, run: RunRows) -> Self {
        let outcome = self.outcome.clone();
        Self {
            path: self.path.clone(),
            origin: self.origin.clone(),
            run,
            fields: self.fields.clone(),
            events: self.events.clone(),
            threads: self.threads.clone(),
            outcome: outcome.map(|outcome| RecordingEnd { lost: 0, ..outcome }),
            ..*self
        }
    }

    /// Returns the run time of the last message, tick or event: under the real clock it may be
    /// late, and come after the end.
    pub(crate) fn last_item(&self) -> Time {
        self.events
            .iter()
            .map(|event| event.at)
            .chain(self.newest())
            .max()
            .unwrap_or_default()
    }

    /// Returns all messages of the topic called `name`, in order of publication.
    pub fn messages<T: Fields>(&self, name: &str) -> Vec<Message<T>> {
        let messages = self.rows(name).into_iter().flat_map(|rows| {
            let indices = 0..rows.len();
            indices.filter_map(|index| rows.message(index))
        });
        messages.collect()
    }

    /// Returns the messages of the topic called `name`, as numbers.
    pub fn rows(&self, name: &str) -> Option<&Rows> {
        self.topics.get(self.origin.topology.topic(name)?)
    }

    /// Returns its nodes, each with its ticks.
    pub(crate) fn nodes(&self) -> impl Iterator<Item = (&NodeTopology, &Vec<TickRecord>)> {
        self.origin.topology.nodes.iter().zip(&self.run.ticks)
    }

    /// Returns its end, if it goes on to the end of the run.
    pub(crate) fn end_of_run(&self) -> Option<&RecordingEnd> {
        let outcome = self.outcome.as_ref();
        outcome.filter(|outcome| outcome.end != RunStatus::WentOn)
    }

    /// Returns the result of its run, if that ended with one.
    pub fn result(&self) -> Option<&RunResult> {
        self.outcome.as_ref()?.result()
    }

    /// Returns whether it is a recording of `system`.
    pub fn is_of(&self, system: &dyn System) -> bool {
        let Origin {
            system: name,
            graph_file,
            plant,
            ..
        } = &self.origin;
        let about = system.about();
        name == system.name()
            && graph_file.as_deref() == about.graph_file
            && plant.as_ref() == about.plant
    }

    /// Returns the system of its graph file, which may have one of the `known` ones in the middle;
    /// `None` without an intact file.
    pub fn graph_system(&self, known: &[Arc<dyn System>]) -> Option<Arc<dyn System>> {
        let graph = GraphFile::parse(self.origin.graph_file.as_ref()?).ok()?;
        Some(Arc::new(graph.system(known).ok()?))
    }

    /// Returns the system of the recording: `system` if it is the same, or else a placeholder with
    /// the data of the file.
    pub fn system(&self, system: &Arc<dyn System>) -> Arc<dyn System> {
        if self.is_of(&**system) {
            system.clone()
        } else {
            Arc::new(OtherSystem)
        }
    }

    /// Returns whether the file is complete and undamaged.
    pub fn is_whole(&self) -> bool {
        self.damage.is_none() && self.outcome.is_some()
    }

    /// Returns the defect of the file; `None` if it is whole.
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

impl Deref for Recording {
    type Target = RunRows;

    fn deref(&self) -> &RunRows {
        &self.run
    }
}

impl DerefMut for Recording {
    fn deref_mut(&mut self) -> &mut RunRows {
        &mut self.run
    }
}

/// A placeholder for a system of another program: all its views come from the recording.
struct OtherSystem;

impl System for OtherSystem {
    fn name(&self) -> &str {
        "other"
    }

    fn build(&self, _: &mut Builder<'_>) -> Result<(), BuildError> {
        let why = "the system of this recording is in another program: run it there";
        Err(BuildError::Setting(why.to_owned()))
    }
}
