//! The crews of a graph, taken apart: each for threads of its own, under the real clock and when
//! its run is executed again.

use std::{collections::HashMap, mem::take, ops::ControlFlow};

use super::obey::{self, Obeyed};
use crate::{
    command::{ClockKind, Command},
    graph::{ControlPlane, Graph},
    job::JobKind,
    node::{Fault, Tick},
    scheduling::{Assignment, Crew, Dispatch, Stage, Threads},
    seat::Seat,
    state::RunState,
    sync::{Arc, Mutex, lock},
    time::Time,
    trigger::Wake,
    turns::{Shared, Turn},
};

/// A node ended the run at this run time, or failed.
pub type Outcome = Option<Result<Time, Fault>>;

/// All crews of a graph.
pub(crate) struct Crews {
    pub(crate) all: Vec<CrewNodes>,
    /// The executors whose nodes have a crew each meanwhile.
    split: Vec<SplitExecutor>,
}

/// An executor whose nodes have a crew each.
struct SplitExecutor {
    dispatch: Arc<dyn Dispatch>,
    /// Number of the first of these crews.
    first: usize,
    /// Number of the nodes.
    nodes: usize,
}

/// The nodes of a crew, for its threads.
pub(crate) struct CrewNodes {
    stage: Shared<Stage>,
    seats: Vec<Mutex<Seat>>,
    /// The nodes by their indices in the graph.
    nodes: Vec<usize>,
    names: Vec<Arc<str>>,
    /// Number of the topics that trigger each.
    inputs: Vec<usize>,
    /// Number of threads; none if all nodes run in other processes.
    pub(crate) threads: usize,
    /// Whether its nodes are on their own: there is nobody to take a tick in their place.
    pub(crate) is_own: bool,
    pub(crate) state: Arc<RunState>,
}

/// Work of a node that was done.
pub(crate) struct Done {
    work: Assignment,
    began: Time,
    outcome: Tick,
}

impl Crews {
    /// Takes the crews of `graph`; `wake` gets the arrivals of messages from now on.
    pub(crate) fn of(graph: &mut Graph, wake: Arc<dyn Wake>) -> Self {
        let now = graph.now();
        graph.stage.leave(wake);
        let seats = take(&mut graph.seats).into_iter().enumerate();
        let mut seats: HashMap<usize, Seat> = seats.collect();
        let mut crews = Self {
            all: Vec::new(),
            split: Vec::new(),
        };
        let state = graph.control.state.clone();
        for crew in graph.stage.take_crews() {
            let threads = crew.dispatch.as_ref().map(|dispatch| dispatch.threads());
            let apart = match (threads, crew.dispatch.clone()) {
                (Some(Threads::Cores(_)), Some(dispatch)) => {
                    let schedulers = dispatch.split(crew.scheduler).into_iter();
                    crews.split.push(SplitExecutor {
                        dispatch,
                        first: crews.all.len(),
                        nodes: crew.members.len(),
                    });
                    let apart = schedulers.zip(crew.members);
                    apart.map(|(all, member)| Crew::of(all, member)).collect()
                }
                _ => vec![crew],
            };
            for crew in apart {
                let members = crew.members.iter();
                let own = members.filter_map(|member| seats.remove(&member.node));
                let own = own.collect();
                let nodes = CrewNodes::new(crew, own, state.clone());
                nodes.stage.aside().open(now, Vec::new);
                crews.all.push(nodes);
            }
        }
        crews
    }

    /// Puts them back.
    pub(crate) fn put_back(self, graph: &mut Graph) {
        let mut seats = Vec::new();
        let mut crews: Vec<Crew> = Vec::new();
        for nodes in self.all {
            let turns = nodes.stage.turns();
            let own = nodes.stage.aside().take_crews().into_iter();
            crews.extend(own.map(|crew| Crew { turns, ..crew }));
            let own = nodes.seats.into_iter().map(into_inner);
            seats.extend(nodes.nodes.into_iter().zip(own));
        }
        for split in self.split.into_iter().rev() {
            let apart = crews.drain(split.first..split.first + split.nodes);
            let (schedulers, members): (Vec<_>, Vec<_>) =
                apart.map(|crew| (crew.scheduler, crew.members)).unzip();
            let members = members.into_iter().flatten().collect();
            crews.splice(
                split.first..split.first,
                Crew::joined(split.dispatch, schedulers, members),
            );
        }
        graph.stage.set_crews(crews);
        seats.sort_by_key(|(node, _)| *node);
        graph.seats = seats.into_iter().map(|(_, seat)| seat).collect();
    }
}

impl CrewNodes {
    fn new(crew: Crew, seats: Vec<Seat>, state: Arc<RunState>) -> Self {
        let dispatch = crew.dispatch.as_ref();
        let threads = match dispatch.map(|dispatch| dispatch.threads()) {
            Some(Threads::Shared(threads)) => threads,
            _ => 1,
        };
        let here = crew.members.iter().filter(|member| !member.remote).count();
        let nodes: Vec<usize> = crew.members.iter().map(|member| member.node).collect();
        let first = seats.first().map_or("", |seat| &*seat.name);
        Self {
            // A node ticks once at a time: more threads would have nothing to do.
            threads: threads.min(here),
            is_own: dispatch.is_none(),
            nodes,
            inputs: crew.members.iter().map(|member| member.inputs).collect(),
            names: seats.iter().map(|seat| seat.name.clone()).collect(),
            stage: Shared::after(
                crew.turns,
                format!("the executor of {first}"),
                Stage::of_crew(ClockKind::Real, crew),
            ),
            seats: seats.into_iter().map(Mutex::new).collect(),
            state,
        }
    }

    /// The nodes by their indices in the graph.
    pub(crate) fn nodes(&self) -> &[usize] {
        &self.nodes
    }

    /// The place of the node called `name`.
    pub(crate) fn place_of(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|known| **known == *name)
    }

    /// Whether a topic triggers the node at this place, by its number.
    pub(crate) fn has_input(&self, place: usize, input: usize) -> bool {
        let inputs = self.inputs.get(place);
        inputs.is_some_and(|inputs| input < *inputs)
    }

    /// Index and name of its first node.
    pub(crate) fn first(&self) -> (usize, Arc<str>) {
        (self.nodes[0], self.names[0].clone())
    }

    /// Whether several threads share the schedule, in turns.
    pub(crate) fn is_shared(&self) -> bool {
        self.threads > 1
    }

    /// The schedule, for a turn of a thread.
    pub(crate) fn stage(&self) -> Turn<'_, Stage> {
        match self.is_shared() {
            true => self.stage.lock(),
            false => self.stage.aside(),
        }
    }

    /// The schedule, for a look.
    pub(crate) fn aside(&self) -> Turn<'_, Stage> {
        self.stage.aside()
    }

    /// Has a node do its work, which begins at run time `began`.
    pub(crate) fn work(&self, work: Assignment, began: Time) -> Done {
        let seat = &mut *lock(&self.seats[work.place]);
        self.state.advance_to(began);
        let outcome = seat.work(work.job, began, true);
        Done {
            work,
            began,
            outcome,
        }
    }

    /// The work of a node was over at `ended`; ticks due before `passed` are missed.
    pub(crate) fn done(&self, done: Done, ended: Time, passed: Time) -> Outcome {
        let Done {
            work,
            began,
            outcome,
        } = done;
        let has_begun = outcome.is_ok() || work.job.kind != JobKind::Begin;
        // Nobody gets the node before its tick is recorded.
        let _stage = has_begun.then(|| {
            let mut stage = self.stage();
            stage.done(work, passed, ended);
            stage
        });
        let seat = &mut *lock(&self.seats[work.place]);
        let took = Some(ended.since(began));
        let outcome = seat.done(work.job, began, took, outcome);
        match outcome {
            Ok(ControlFlow::Continue(())) => None,
            Ok(ControlFlow::Break(())) => Some(Ok(began)),
            Err(cause) => Some(Err(seat.fault(began, cause))),
        }
    }

    /// Has the node at this place carry out its command at run time `at`; returns the position
    /// of the event.
    pub(crate) fn obey(
        &self,
        stage: &mut Stage,
        place: usize,
        command: &Command,
        at: Time,
    ) -> usize {
        self.state.advance_to(at);
        let seat = &mut *lock(&self.seats[place]);
        let answer = match command.knob_of_node() {
            Some(knob) => stage.turn(place, seat, knob, at),
            None => Err(format!("{command} is not for a node")),
        };
        self.state.answered(at, command, answer)
    }
}

/// Carries out a command that no node can, while the nodes are on their threads.
pub(crate) fn supervise(control: &mut ControlPlane, command: &Command, at: Time) -> Obeyed {
    let unknown = command
        .node()
        .and_then(|node| control.local_index(node).err());
    let obeyed = match unknown {
        Some(reason) => obey::refuse(control, command, at, &reason),
        None => obey::obey(control, ClockKind::Real, command, at),
    };
    if obeyed.exit.is_some() || control.status.paused {
        // A node may have begun a tick later than `at` already.
        control.state.advance_to(at);
    }
    obeyed
}

fn into_inner<T>(mutex: Mutex<T>) -> T {
    let inner = mutex.into_inner();
    inner.unwrap_or_else(|poisoned| poisoned.into_inner())
}
