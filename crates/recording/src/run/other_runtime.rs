//! A run on another runtime as a recording.

use std::{collections::BTreeMap, path::PathBuf, sync::Arc};

use ratelab::{ClockExit, ClockKind, Event, EventKind};
use ratelab_experiment::{Config, Experiment, Summary};
use ratelab_metrics::{Rows, TickRecord};
use ratelab_system::{BuildError, System};

use super::{
    origin::{Origin, RecordingEnd, RunResult, RunStatus},
    recording::Recording,
    series::RunRows,
};

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
