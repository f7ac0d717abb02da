//! The crews of a graph, taken apart: each for threads of its own, under the real clock and when
//! its run is executed again.

use std::mem::take;

use super::{crew_stage::CrewStage, crew_thread::CrewThread, obey::Supervision};
use crate::{
    graph::Graph,
    scheduling::{Crew, Dispatch, Stage, Threads},
    sync::Arc,
    trigger::{Arrival, Wake},
};

/// The crews of a graph, each with a stage of its own, until this is dropped.
pub struct Crews<'g> {
    all: Vec<CrewStage<'g>>,
    /// The executors whose nodes have a crew each meanwhile.
    split: Vec<SplitExecutor>,
    /// The stage of all of them.
    home: &'g mut Stage,
}

/// An executor whose nodes have a crew each.
struct SplitExecutor {
    dispatch: Arc<dyn Dispatch>,
    /// Number of the first of these crews.
    first: usize,
    /// Number of the nodes.
    nodes: usize,
}

/// Nobody waits for messages: the log knows when nodes hear of them.
struct Unheard;

impl Wake for Unheard {
    fn wake(&self, _: Arrival) {}
}

impl Graph {
    /// The crews of the graph, each for threads in the hands of the caller, and what is left
    /// without them.
    pub fn apart(&mut self) -> (Crews<'_>, Supervision<'_>) {
        self.apart_with(Arc::new(Unheard))
    }

    /// The same; `wake` gets the arrivals of messages from now on.
    pub(crate) fn apart_with(&mut self, wake: Arc<dyn Wake>) -> (Crews<'_>, Supervision<'_>) {
        let now = self.now();
        self.stage.leave(wake);
        let mut crews = Crews {
            all: Vec::new(),
            split: Vec::new(),
            home: &mut self.stage,
        };
        for crew in crews.home.take_crews() {
            for crew in crews.split(crew) {
                let state = self.control.state.clone();
                let stage = CrewStage::new(crew, &self.seats, state);
                stage.aside().open(now, Vec::new);
                crews.all.push(stage);
            }
        }
        let control = &mut self.control;
        (crews, Supervision { control })
    }
}

impl Crews<'_> {
    /// A crew, or those of its nodes if each has a thread of its own.
    fn split(&mut self, crew: Crew) -> Vec<Crew> {
        match crew.dispatch.clone() {
            Some(dispatch) if matches!(dispatch.threads(), Threads::Cores(_)) => {
                self.split.push(SplitExecutor {
                    dispatch: dispatch.clone(),
                    first: self.all.len(),
                    nodes: crew.members.len(),
                });
                crew.split(&*dispatch)
            }
            _ => vec![crew],
        }
    }

    /// The crews with threads here.
    pub(crate) fn here(&self) -> impl Iterator<Item = &CrewStage<'_>> {
        self.all.iter().filter(|crew| crew.threads > 0)
    }

    /// The threads that nodes have, each with the index of the node that it is numbered by.
    pub fn threads(&self) -> impl Iterator<Item = (usize, CrewThread<'_>)> {
        self.here().flat_map(threads)
    }
}

/// The threads of a crew, each with the index of the node that it is numbered by.
pub(crate) fn threads<'c>(crew: &'c CrewStage<'c>) -> Vec<(usize, CrewThread<'c>)> {
    let stage = crew.aside();
    let nodes = stage.members().take(crew.threads);
    nodes
        .map(|member| (member.node, CrewThread::new(crew)))
        .collect()
}

impl Drop for Crews<'_> {
    /// Puts the crews together again.
    fn drop(&mut self) {
        let all = take(&mut self.all).into_iter();
        let mut crews: Vec<Crew> = all.flat_map(CrewStage::into_crews).collect();
        for split in take(&mut self.split).into_iter().rev() {
            let range = split.first..split.first + split.nodes;
            let apart = crews.drain(range).collect();
            let at = split.first..split.first;
            crews.splice(at, Crew::joined(split.dispatch, apart));
        }
        self.home.set_crews(crews);
    }
}
