//! What would make an age younger, or spare overruns: changes that follow from a graph, each of
//! which is run.

use std::{cmp::Reverse, num::NonZeroUsize, ops::ControlFlow, sync::Arc};

use ratelab::{Interrupt, Topology};

pub use crate::candidates::AgeChange;
use crate::{
    Config, Experiment, RunAge, Summary,
    candidates::{Candidates, upstream},
    parallel::in_parallel,
};
use ratelab_system::{Setup, System, graph_file::GraphFile};

/// The most changes that are tried, first for the oldest parts.
const MOST: usize = 200;

/// What the changes of a run are to make less.
#[derive(Clone, Debug)]
pub enum Aim<'a> {
    /// An age.
    Age(&'a RunAge),
    /// The skipped periods of these nodes.
    Overruns(&'a [&'a str]),
}

/// Returns the changes to try for an `aim` of a run of `system` with `setup`, whose graph is
/// `topology`.
pub fn changes(
    system: &dyn System,
    setup: &Setup,
    topology: &Topology,
    aim: &Aim<'_>,
) -> Vec<AgeChange> {
    let text = system.about().graph_file;
    let graph = Candidates {
        topology,
        setup,
        file: text.and_then(|text| GraphFile::parse(text).ok()),
    };
    let nodes = match aim {
        Aim::Age(age) => {
            let owned = |name: &str| {
                let parts = age.parts.iter().filter(|part| part.owner == name);
                Reverse(parts.map(|part| part.ns).sum::<i64>())
            };
            let mut nodes = topology
                .node(&age.node)
                .map_or_else(Vec::new, |node| upstream(topology, node));
            nodes.sort_by_key(|node| owned(&topology.nodes[*node].name));
            nodes
        }
        Aim::Overruns(names) => graph.beside(names),
    };
    let reads = |topic: &usize| {
        let mut readers = topology.topics[*topic].readers.iter();
        matches!(aim, Aim::Age(_)) && readers.any(|reader| nodes.contains(reader))
    };
    let of_topics = (0..topology.topics.len())
        .filter(reads)
        .flat_map(|topic| graph.topic_changes(topic));
    let of_nodes = nodes.iter().flat_map(|node| graph.node_changes(*node));
    let of_clock = graph
        .file
        .iter()
        .flat_map(GraphFile::clock_changes)
        .map(AgeChange::in_file);
    let mut changes: Vec<AgeChange> = Vec::new();
    for change in of_clock.chain(of_topics).chain(of_nodes) {
        if !changes.contains(&change) {
            changes.push(change);
        }
    }
    changes.truncate(MOST);
    changes
}

/// Runs each system with its configuration on `threads` threads, until `interrupt` is asked for, and
/// calls `done` after each run. Returns the summaries with their ages; `None` for a run that is
/// refused, fails or is stopped.
pub fn run_all(
    runs: &[(Arc<dyn System>, Config)],
    interrupt: &Interrupt,
    threads: NonZeroUsize,
    mut done: impl FnMut(),
) -> Vec<Option<Summary>> {
    let mut summaries = vec![None; runs.len()];
    let work = |index: usize| {
        let (system, config) = &runs[index];
        (!interrupt.is_asked()).then(|| {
            let mut experiment = Experiment::new(system.clone(), config).ok()?;
            experiment.watch_ages();
            experiment.run_until(interrupt).ok()?
        })
    };
    in_parallel(threads, runs.len(), work, |index, summary| {
        summaries[index] = summary;
        done();
        ControlFlow::Continue(())
    });
    summaries
}
