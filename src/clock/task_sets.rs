//! The task sets of a graph in the hands of a clock with threads, while it runs.

use std::mem::take;

use super::{
    obey::Supervision,
    worker::{CoreClaim, SharedSchedule, Worker},
};
use crate::{
    arrival::{Arrival, Arrivals, Wake},
    graph::Graph,
    scheduling::{
        Schedule, TaskSet,
        executors::executor::{Team, Threads},
    },
    sync::Arc,
};

/// The task sets of a graph, each with a schedule of its own, until this is dropped.
pub struct TaskSets<'g> {
    all: Vec<SharedSchedule<'g>>,
    /// The executors whose nodes have a task set each meanwhile.
    split: Vec<SplitExecutor>,
    /// The schedule of all of them.
    home: &'g mut Schedule,
    /// What is published for nodes that messages trigger.
    arrivals: &'g Arrivals,
    /// The messages that were in flight when they were taken apart.
    in_flight: Vec<Arrival>,
}

/// An executor whose nodes have a task set each.
struct SplitExecutor {
    team: Arc<Team>,
    /// Number of the first of these task sets.
    first: usize,
    /// Number of the nodes.
    nodes: usize,
}

/// The threads of a task set.
pub struct ThreadGroup<'c> {
    /// Name of its first node.
    pub name: Arc<str>,
    /// The indices of its nodes that run here.
    pub nodes: Vec<usize>,
    /// The cores that its one thread shares with the threads of other nodes.
    pub claim: Option<CoreClaim>,
    /// Its threads, each with the index of the node that it is numbered by.
    pub workers: Vec<(usize, Worker<'c>)>,
}

impl Graph {
    /// Returns the task sets of the graph, each for threads in the hands of the caller, and what is
    /// left without them.
    pub fn apart(&mut self) -> (TaskSets<'_>, Supervision<'_>) {
        let now = self.now();
        self.schedule.leave();
        let in_flight = self.in_flight(now);
        let mut task_sets = TaskSets {
            all: Vec::new(),
            split: Vec::new(),
            home: &mut self.schedule,
            arrivals: &self.arrivals,
            in_flight,
        };
        for whole in task_sets.home.take_task_sets() {
            for (task_set, claim) in task_sets.split(whole) {
                let state = self.control.state.clone();
                let schedule = SharedSchedule::new(task_set, claim, &self.slots, state);
                schedule.peek().open(now, []);
                task_sets.all.push(schedule);
            }
        }
        let control = &mut self.control;
        (task_sets, Supervision { control })
    }
}

impl TaskSets<'_> {
    /// Returns a task set, or one for each node if each has a thread of its own, with the claims.
    fn split(&mut self, task_set: TaskSet) -> Vec<(TaskSet, Option<CoreClaim>)> {
        let threads = task_set.threads();
        let (Some(team), Some(Threads::Cores(cores))) = (task_set.team.clone(), threads) else {
            return vec![(task_set, None)];
        };
        let executor = self.split.len();
        self.split.push(SplitExecutor {
            team: team.clone(),
            first: self.all.len(),
            nodes: task_set.members.len(),
        });
        let ranks = task_set.ranks();
        let claims = ranks.into_iter().map(|rank| CoreClaim {
            executor,
            cores,
            rank,
        });
        let claims: Vec<_> = claims.map(Some).collect();
        task_set.split(&team).into_iter().zip(claims).collect()
    }

    /// Forwards the arrivals of messages to `wake`, first of all messages in flight.
    pub fn wake_by(&self, wake: Arc<dyn Wake>) {
        self.arrivals.forward_to(Some(wake.clone()));
        self.in_flight
            .iter()
            .copied()
            .chain(self.arrivals.take())
            .for_each(|arrival| wake.wake(arrival));
    }

    /// Returns the threads of the task sets that have some here.
    pub fn groups(&self) -> Vec<ThreadGroup<'_>> {
        self.all
            .iter()
            .filter(|schedule| schedule.threads > 0)
            .map(group)
            .collect()
    }
}

/// Returns the threads of a task set.
fn group<'c>(schedule: &'c SharedSchedule<'c>) -> ThreadGroup<'c> {
    let held = schedule.peek();
    let mut names = held.members().map(|member| member.name.clone());
    let numbered = held.members().take(schedule.threads);
    let here = held.members().filter(|member| !member.remote);
    ThreadGroup {
        name: names.next().unwrap_or_else(|| "".into()),
        nodes: here.map(|member| member.node).collect(),
        claim: schedule.claim,
        workers: numbered
            .map(|member| (member.node, Worker::new(schedule)))
            .collect(),
    }
}

impl Drop for TaskSets<'_> {
    /// Puts the task sets together again.
    fn drop(&mut self) {
        self.arrivals.forward_to(None);
        let mut task_sets: Vec<TaskSet> = take(&mut self.all)
            .into_iter()
            .filter_map(SharedSchedule::into_task_set)
            .collect();
        for split in take(&mut self.split).into_iter().rev() {
            let range = split.first..split.first + split.nodes;
            let apart = task_sets.drain(range).collect();
            let at = split.first..split.first;
            task_sets.splice(at, TaskSet::joined(split.team, apart));
        }
        self.home.set_task_sets(task_sets);
    }
}
