//! A recorded run, its lineage, and a run on another runtime as one.

use std::{
    collections::BTreeMap,
    ops::{Deref, DerefMut},
    path::PathBuf,
    sync::Arc,
};

use ratelab::{
    ClockExit, ClockKind, Event, EventKind, Knob, Message, NodeTopology, Time, TimedKnob,
};
use ratelab_experiment::{Config, Experiment, RunAge, RunAges, Summary};
use ratelab_metrics::{Fields, Lineage, Rows, TickRecord};
use ratelab_re_execution::Log;
use ratelab_system::{
    BuildError, Builder, PlanBar, PlanBars, Planning, System, graph_file::GraphFile,
};

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

impl Recording {
    /// Returns the chains behind the actions of the run.
    pub fn lineage(&self) -> Lineage {
        let setup = self.origin.config.setup.iter();
        let mut lineage = Lineage::new(self.origin.topology.clone(), setup);
        self.events.iter().for_each(|event| lineage.event(event));
        for (topic, rows) in self.topics.iter().enumerate() {
            rows.heads()
                .iter()
                .for_each(|head| lineage.message(topic, head));
        }
        for (node, ticks) in self.ticks.iter().enumerate() {
            ticks
                .iter()
                .for_each(|tick| lineage.tick(node, tick.clone()));
        }
        lineage.settle();
        lineage
    }

    /// Returns whether it holds the run from its start.
    pub fn begins_with_run(&self) -> bool {
        let mut ticks = self.ticks.iter().filter_map(|ticks| ticks.first());
        let mut heads = self.topics.iter().filter_map(|rows| rows.heads().first());
        ticks.all(|tick| tick.number == 0) && heads.all(|head| head.seq == 0)
    }

    /// Returns the ages of the whole run of `system` with this `summary`, with their parts; none
    /// without all messages and ticks.
    pub fn ages(&self, system: &dyn System, summary: &Summary) -> Vec<RunAge> {
        let lost = self.outcome.as_ref().map_or(0, |outcome| outcome.lost);
        match lost {
            0 => RunAges::new(system, self.lineage()).finish(summary.sim_time, &summary.nodes),
            _ => Vec::new(),
        }
    }

    /// Returns the plans of the run as bars, by lane.
    pub fn plan_lanes(&self, planning: &Planning) -> Vec<Vec<PlanBar>> {
        PlanBars::of(planning, |topic| self.rows(topic)).lanes()
    }

    /// Returns the knobs of the run in the order in which they were turned, beginning with the
    /// knobs of the start.
    pub fn knobs(&self) -> Vec<TimedKnob> {
        let start = self
            .origin
            .config
            .setup
            .iter()
            .cloned()
            .map(|knob| TimedKnob {
                at: Time::ZERO,
                knob,
            });
        let later = self.events.iter().filter_map(Event::knob);
        start.chain(later).collect()
    }

    /// Finds the time at which each tick of all nodes published and acted: the end of a
    /// tick with a configured duration, the start of any other.
    pub(crate) fn find_ends(&mut self) {
        let knobs = self.knobs();
        let nodes = self.origin.topology.nodes.iter();
        for (node, ticks) in nodes.zip(&mut self.run.ticks) {
            let mut mine = knobs
                .iter()
                .filter(|timed| timed.knob.target() == node.name)
                .peekable();
            let (mut takes, mut hangs) = (false, false);
            for tick in ticks {
                while let Some(timed) = mine.next_if(|timed| timed.at <= tick.at) {
                    match &timed.knob {
                        Knob::Takes { .. } => takes = timed.knob.takes_time(),
                        Knob::Hang { .. } => hangs = true,
                        Knob::Crash { .. } | Knob::Restart { .. } => hangs = false,
                        _ => {}
                    }
                }
                tick.ends = if std::mem::take(&mut hangs) || takes {
                    tick.took.map(|took| tick.at + took)
                } else {
                    Some(tick.at)
                };
            }
        }
    }
}

/// Returns the end of a tick; under the real clock in wall time.
pub fn end_of(tick: &TickRecord) -> Time {
    let took = tick.lateness.and(tick.took).unwrap_or_default();
    tick.ends.unwrap_or(tick.at).max(tick.at + took)
}

/// A run of a system on another runtime, in virtual time and to its end.
#[derive(Clone, Debug)]
pub struct OtherRun {
    /// The configuration of the same run on our runtime.
    pub config: Config,
    /// The messages of each topic, by its name.
    pub topics: BTreeMap<String, Rows>,
    /// The ticks of each node, by its name.
    pub ticks: BTreeMap<String, Vec<TickRecord>>,
    /// The reason for its end.
    pub exit: ClockExit,
}

/// The place of the file in messages.
const NAME: &str = "your runtime";

impl Recording {
    /// Returns `run` of `system` as a complete recording without a file. Topics and nodes that it
    /// lacks are empty.
    ///
    /// # Errors
    /// [`BuildError`] if its configuration is invalid.
    pub fn from_other_runtime(
        mut run: OtherRun,
        system: &Arc<dyn System>,
    ) -> Result<Self, BuildError> {
        let graph = Experiment::new(system.clone(), &run.config)?;
        let topology = graph.observer().topology();
        let topics = topology
            .topics
            .iter()
            .map(|topic| run.topics.remove(&topic.name).unwrap_or_default());
        let ticks = topology
            .nodes
            .iter()
            .map(|node| run.ticks.remove(&node.name).unwrap_or_default());
        let run_rows = RunRows {
            topics: topics.collect(),
            ticks: ticks.collect(),
        };
        let ended = match &run.exit {
            ClockExit::Ended { node, at } => Some((node.clone(), *at)),
            _ => None,
        };
        let until = ended.as_ref().map_or(run.config.end, |(_, at)| *at);
        let events = ended.into_iter().map(|(node, at)| {
            let what = EventKind::Ended { node };
            Event { at, what }
        });
        let origin = Origin::new(&**system, run.config, topology);
        let mut recording = Self {
            path: PathBuf::from(NAME),
            run: run_rows,
            events: events.collect(),
            until,
            ..Self::empty(origin)
        };
        let rows = [system.states_topic(), system.chains_topic()].map(|name| recording.rows(name?));
        let newest = rows.map(|rows| rows.and_then(Rows::last).map(|(_, row)| row));
        let verdict = system.verdict(&run.exit, until, newest);
        let summary = Summary {
            steps: rows[0].map_or(0, Rows::len) as u64,
            state: newest[0].map_or_else(Vec::new, <[f64]>::to_vec),
            ..Summary::new(&recording.origin.config, verdict)
        };
        let dropped = |rows: &Rows| rows.last().map_or(0, |(head, _)| head.dropped);
        let [messages, ticks] = recording.counts();
        recording.outcome = Some(RecordingEnd {
            at: until,
            clock: ClockKind::Virtual,
            end: RunStatus::Ended(RunResult::new(&**system, &summary)),
            messages,
            ticks,
            lost: 0,
            dropped: Some(recording.topics.iter().map(dropped).collect()),
            unmatched: None,
            threads: None,
            digest: None,
        });
        Ok(recording)
    }
}
