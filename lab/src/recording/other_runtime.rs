//! A run on another runtime as a recording.

use std::{collections::BTreeMap, path::PathBuf, sync::Arc};

use ratelab::{ClockExit, ClockKind, Event, EventKind};
use ratelab_account::{Rows, TickRecord};
use ratelab_study::{
    experiment::{Config, Experiment, Summary},
    system::{BuildError, System, verdict},
};

use super::{
    reader::Recording,
    schema::{Origin, RecordingEnd, RunResult, RunStatus},
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
    /// `run` of `system` as a complete recording without a file. Topics and nodes that it
    /// lacks are empty.
    ///
    /// # Errors
    /// [`BuildError`] if its configuration is invalid.
    pub fn of_other_runtime(
        mut run: OtherRun,
        system: &Arc<dyn System>,
    ) -> Result<Self, BuildError> {
        let graph = Experiment::new(system.clone(), &run.config)?;
        let topology = graph.observer().topology();
        let topics = topology.topics.iter();
        let topics: Vec<Rows> = topics
            .map(|topic| run.topics.remove(&topic.name).unwrap_or_default())
            .collect();
        let nodes = topology.nodes.iter();
        let ticks: Vec<_> = nodes
            .map(|node| run.ticks.remove(&node.name).unwrap_or_default())
            .collect();
        let (until, events) = match &run.exit {
            ClockExit::Ended { node, at } => {
                let node = node.clone();
                let what = EventKind::Ended { node };
                (*at, vec![Event { at: *at, what }])
            }
            _ => (run.config.end, Vec::new()),
        };
        let named = |name: Option<&str>| {
            let mut names = topology.topics.iter().map(|topic| topic.name.as_str());
            topics.get(names.position(|topic| Some(topic) == name)?)
        };
        let states = named(system.state());
        let newest = [states, named(system.chains())];
        let newest = newest.map(|rows| rows.and_then(Rows::last).map(|(_, row)| row));
        let verdict = verdict(&**system, &run.exit, until, newest);
        let summary = Summary {
            steps: states.map_or(0, Rows::len) as u64,
            state: newest[0].map_or_else(Vec::new, <[f64]>::to_vec),
            ..Summary::of(&run.config, verdict)
        };
        let dropped = |rows: &Rows| rows.last().map_or(0, |(head, _)| head.dropped);
        let outcome = RecordingEnd {
            at: until,
            clock: ClockKind::Virtual,
            end: RunStatus::Ended(RunResult::new(&**system, &summary)),
            messages: topics.iter().map(|rows| rows.len() as u64).collect(),
            ticks: ticks.iter().map(|ticks| ticks.len() as u64).collect(),
            lost: 0,
            dropped: Some(topics.iter().map(dropped).collect()),
            threads: None,
            digest: None,
        };
        Ok(Self {
            path: PathBuf::from(NAME),
            bytes: 0,
            origin: Origin::new(&**system, run.config, topology),
            topics,
            ticks,
            events,
            threads: None,
            until,
            outcome: Some(outcome),
            damage: None,
            altered: false,
        })
    }
}
