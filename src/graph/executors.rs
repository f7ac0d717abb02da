//! Executors of a graph.

use thiserror::Error;

use super::{Graph, GraphError};
use crate::{
    control::command::ClockKind,
    scheduling::{
        TaskSet,
        executors::{
            executor::{Executor, Team, Threads},
            ordered::Callback,
        },
    },
    sync::Arc,
};

impl Graph {
    /// Runs these nodes, which were added before, by an executor, in the order of registration. Each
    /// executor has threads of its own, under the real clock as well: there `fixed-priority` and
    /// `edf` need real-time priority and cores to spare.
    ///
    /// ```
    /// use std::sync::{Arc, atomic::{AtomicU32, Ordering::Relaxed}};
    /// use ratelab::{Callback, Graph, Tick};
    ///
    /// let (mut graph, ticks) = (Graph::new(), Arc::new(AtomicU32::new(0)));
    /// for node in ["lidar", "planner"] {
    ///     let ticks = ticks.clone();
    ///     graph.node(node, 10.0, 0, |_| move |_: &mut Tick| {
    ///         ticks.fetch_add(1, Relaxed);
    ///     })?;
    /// }
    /// graph.executor("single".parse()?, ["lidar", "planner"].map(Callback::new))?;
    /// // No tick at 0: a timer of ROS is due one period later for the first time.
    /// graph.run_virtual(1.0)?;
    /// assert_eq!(ticks.load(Relaxed), 20);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`GraphError`] for a node that is unknown, that has an executor already, or that
    /// lacks the period that the executor needs.
    pub fn executor(
        &mut self,
        executor: Executor,
        callbacks: impl IntoIterator<Item = Callback>,
    ) -> Result<(), GraphError> {
        let team = Arc::new(Team::new(executor, callbacks.into_iter().collect()));
        let mut nodes: Vec<usize> = Vec::new();
        for (number, name) in team.names().enumerate() {
            let node = self.index_for(&team, number, name)?;
            if nodes.contains(&node) {
                return Err(GraphError::SecondExecutor(name.to_owned()));
            }
            nodes.push(node);
        }
        let task_sets = self.schedule.take_task_sets().into_iter();
        let is_member = |task_set: &TaskSet| nodes.iter().any(|node| task_set.is_own(*node));
        let (mut own, mut task_sets): (Vec<TaskSet>, Vec<TaskSet>) = task_sets.partition(is_member);
        let index = task_sets
            .iter()
            .filter(|task_set| task_set.is_executor())
            .count();
        own.sort_by_key(|task_set| nodes.iter().position(|node| task_set.is_own(*node)));
        let joined = TaskSet::joined(team.clone(), own);
        let together = joined.iter().any(TaskSet::is_executor);
        task_sets.extend(joined);
        self.schedule.set_task_sets(task_sets);
        for (number, node) in nodes.into_iter().enumerate() {
            let node = &mut self.control.nodes[node];
            node.executor = Some(executor.to_string());
            node.executor_index = together.then_some(index);
            node.group = team.group(number).map(Into::into);
        }
        Ok(())
    }

    /// Returns the index of a member, if the executor can have it.
    fn index_for(&self, team: &Team, number: usize, name: &str) -> Result<usize, GraphError> {
        let mut nodes = self.control.nodes.iter();
        let known = nodes.position(|node| node.name == name);
        let unknown = || GraphError::UnknownCallback(name.to_owned(), team.executor.to_string());
        let index = known.ok_or_else(unknown)?;
        let node = &self.control.nodes[index];
        if node.executor.is_some() {
            return Err(GraphError::SecondExecutor(name.to_owned()));
        }
        let remedy = team.period_remedy(number);
        match remedy.filter(|_| !node.triggers.is_empty()) {
            Some(remedy) => Err(GraphError::NoPeriod {
                node: name.to_owned(),
                executor: team.executor.to_string(),
                remedy,
            }),
            None => Ok(index),
        }
    }

    /// Sets the number of cores that the real clock has for preemptive executors; see
    /// [`Clock::cores`](crate::Clock::cores).
    pub fn set_cores(&mut self, cores: Option<usize>) {
        self.cores = cores;
    }

    /// Returns why the graph cannot run under this clock, with the remedy.
    pub fn refusal_of(&self, clock: ClockKind) -> Option<String> {
        let refusal = self.needs_virtual_time()?;
        (clock == ClockKind::Real).then(|| refusal.to_string())
    }

    /// Returns the node that the real clock cannot run, if the graph has one.
    pub fn needs_virtual_time(&self) -> Option<RealClockRefusal> {
        let mut spare = self.cores.unwrap_or(0);
        self.schedule.task_sets().iter().find_map(|task_set| {
            let executor = task_set.team.as_ref()?.executor;
            let why = match executor.threads() {
                Threads::Cores(_) if self.cores.is_none() => {
                    format!("under the real clock {executor} needs real-time priority (--realtime)")
                }
                Threads::Cores(cores) if cores > spare => format!(
                    "under the real clock {executor} needs {cores} cores beside the one for all \
                     other threads, and {spare} are left"
                ),
                Threads::Cores(cores) => {
                    spare -= cores;
                    return None;
                }
                Threads::Shared(_) => return None,
            };
            let first = task_set.members.first()?;
            Some(RealClockRefusal {
                node: first.name.to_string(),
                why: format!("{why}: choose the virtual clock"),
            })
        })
    }
}

/// Why the real clock cannot run a graph.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{node}: {why}")]
pub struct RealClockRefusal {
    /// Name of the node that it cannot run.
    pub node: String,
    /// The reason and the remedy.
    pub why: String,
}
