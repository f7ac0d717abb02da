//! The task sets of a graph, taken apart: each for threads of its own, under the real clock and
//! when its run is executed again.

use std::mem::take;

use super::{obey::Supervision, shared_schedule::SharedSchedule, worker::Worker};
use crate::{
    graph::Graph,
    scheduling::{Dispatch, Schedule, TaskSet, Threads},
    sync::Arc,
    trigger::{Arrival, Wake},
};

/// The task sets of a graph, each with a schedule of its own, until this is dropped.
pub struct TaskSets<'g> {
    all: Vec<SharedSchedule<'g>>,
    /// The executors whose nodes have a task set each meanwhile.
    split: Vec<SplitExecutor>,
    /// The schedule of all of them.
    home: &'g mut Schedule,
}

/// An executor whose nodes have a task set each.
struct SplitExecutor {
    dispatch: Arc<dyn Dispatch>,
    /// Number of the first of these task sets.
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
    /// The task sets of the graph, each for threads in the hands of the caller, and what is left
    /// without them.
    pub fn apart(&mut self) -> (TaskSets<'_>, Supervision<'_>) {
        self.apart_with(Arc::new(Unheard))
    }

    /// Takes them apart, and has `wake` get the arrivals of messages from now on.
    pub(crate) fn apart_with(&mut self, wake: Arc<dyn Wake>) -> (TaskSets<'_>, Supervision<'_>) {
        let now = self.now();
        self.schedule.leave(wake);
        let mut task_sets = TaskSets {
            all: Vec::new(),
            split: Vec::new(),
            home: &mut self.schedule,
        };
        for whole in task_sets.home.take_task_sets() {
            for task_set in task_sets.split(whole) {
                let state = self.control.state.clone();
                let schedule = SharedSchedule::new(task_set, &self.slots, state);
                schedule.peek().open(now, Vec::new);
                task_sets.all.push(schedule);
            }
        }
        let control = &mut self.control;
        (task_sets, Supervision { control })
    }
}

impl TaskSets<'_> {
    /// A task set, or those of its nodes if each has a thread of its own.
    fn split(&mut self, task_set: TaskSet) -> Vec<TaskSet> {
        match task_set.dispatch.clone() {
            Some(dispatch) if matches!(dispatch.threads(), Threads::Cores(_)) => {
                self.split.push(SplitExecutor {
                    dispatch: dispatch.clone(),
                    first: self.all.len(),
                    nodes: task_set.members.len(),
                });
                task_set.split(&*dispatch)
            }
            _ => vec![task_set],
        }
    }

    /// The schedules of task sets with threads here.
    pub(crate) fn here(&self) -> impl Iterator<Item = &SharedSchedule<'_>> {
        self.all.iter().filter(|schedule| schedule.threads > 0)
    }

    /// The threads that nodes have, each with the index of the node that it is numbered by.
    pub fn threads(&self) -> impl Iterator<Item = (usize, Worker<'_>)> {
        self.here().flat_map(threads)
    }
}

/// The threads of a task set, each with the index of the node that it is numbered by.
pub(crate) fn threads<'c>(schedule: &'c SharedSchedule<'c>) -> Vec<(usize, Worker<'c>)> {
    let held = schedule.peek();
    let nodes = held.members().take(schedule.threads);
    nodes
        .map(|member| (member.node, Worker::new(schedule)))
        .collect()
}

impl Drop for TaskSets<'_> {
    /// Puts the task sets together again.
    fn drop(&mut self) {
        let all = take(&mut self.all).into_iter();
        let mut task_sets: Vec<TaskSet> = all.flat_map(SharedSchedule::into_task_sets).collect();
        for split in take(&mut self.split).into_iter().rev() {
            let range = split.first..split.first + split.nodes;
            let apart = task_sets.drain(range).collect();
            let at = split.first..split.first;
            task_sets.splice(at, TaskSet::joined(split.dispatch, apart));
        }
        self.home.set_task_sets(task_sets);
    }
}
