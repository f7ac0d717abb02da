//! Executors of a graph.

use super::{Graph, GraphError};
use crate::{
    command::ClockKind,
    executor::{Callback, Executor},
    placement::Placement,
    seat::Seat,
};

impl Graph {
    /// Has an executor run these nodes, which were added before, in the order of their
    /// registration. Each executor has threads of its own, under the real clock as well: there
    /// `fixed-priority` needs
    /// [`RealtimePriority`](crate::RealtimePriority) and cores to spare, and
    /// `edf` is refused.
    ///
    /// ```
    /// use std::sync::{Arc, atomic::{AtomicU32, Ordering::Relaxed}};
    /// use ratelab::{Callback, Clock, GO_ON, Graph, Hz, Inbox, Time, VirtualClock};
    ///
    /// let (mut graph, ticks) = (Graph::new(), Arc::new(AtomicU32::new(0)));
    /// for node in ["lidar", "planner"] {
    ///     let ticks = ticks.clone();
    ///     graph.node(node, Hz::new(10.0)?, 0, |_| move |_| {
    ///         ticks.fetch_add(1, Relaxed);
    ///         GO_ON
    ///     })?;
    /// }
    /// graph.executor("single".parse()?, ["lidar", "planner"].map(Callback::of))?;
    /// // No tick at 0: a timer of ROS is due one period later for the first time.
    /// let end = Time::from_secs_f64(1.0)?;
    /// VirtualClock.run(&mut graph, &mut Inbox::default(), end)?;
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
        let mut members: Vec<(usize, Callback)> = Vec::new();
        for callback in callbacks {
            let node = self.index_for(executor, &callback)?;
            if members.iter().any(|(known, _)| *known == node) {
                return Err(GraphError::SecondExecutor(callback.node));
            }
            members.push((node, callback));
        }
        let placement = match executor {
            Executor::Let => Placement::Let,
            _ => Placement::Executor {
                index: self.stage.executors().count(),
                queues: executor.queues_timers(),
            },
        };
        self.stage.add_executor(executor, members.clone());
        let by_call = matches!(
            executor,
            Executor::Single | Executor::Multi { .. } | Executor::Events
        );
        for (index, callback) in members {
            let task = &mut self.stage.tasks[index];
            task.placement = placement;
            let node = &mut self.control.nodes[index].topology;
            node.executor = Some(executor);
            node.executor_index = placement.executor();
            node.group = callback.group_name().map(Into::into);
            if by_call {
                task.rate.skip_first();
            }
        }
        Ok(())
    }

    /// The index of the node of a callback, if the executor can have it.
    fn index_for(&self, executor: Executor, callback: &Callback) -> Result<usize, GraphError> {
        let name = || callback.node.clone();
        let mut tasks = self.stage.tasks.iter();
        let known = tasks.position(|task| *task.name == *callback.node);
        let index = known.ok_or_else(|| GraphError::UnknownCallback(name(), executor))?;
        let task = &self.stage.tasks[index];
        if task.placement != Placement::Thread {
            return Err(GraphError::SecondExecutor(name()));
        }
        let remedy = match executor {
            Executor::Let => Some("give it a rate"),
            Executor::Edf { .. } if callback.deadline.is_none() => Some("give it a deadline"),
            _ => None,
        };
        match remedy.filter(|_| task.is_triggered()) {
            Some(remedy) => Err(GraphError::NoPeriod(name(), executor, remedy)),
            None => Ok(index),
        }
    }

    /// Sets the number of cores that the real clock has for preemptive executors; see
    /// [`Clock::cores`](crate::Clock::cores).
    pub fn set_cores(&mut self, cores: Option<usize>) {
        self.cores = cores;
    }

    /// Why the graph cannot run under this clock, with the remedy.
    pub fn refusal_of(&self, clock: ClockKind) -> Option<String> {
        let (seat, why) = self.needs_virtual_time()?;
        (clock == ClockKind::Real).then(|| format!("{}: {why}", seat.name))
    }

    /// The node that the real clock cannot run, with the reason and the remedy.
    pub(crate) fn needs_virtual_time(&self) -> Option<(&Seat, String)> {
        let mut spare = self.cores.unwrap_or(0);
        let mut executors = self.stage.executors();
        executors.find_map(|(executor, members)| {
            let why = match executor {
                Executor::Edf { .. } => format!("the real clock has no executor {executor}"),
                Executor::FixedPriority { .. } if self.cores.is_none() => {
                    format!("under the real clock {executor} needs real-time priority (--realtime)")
                }
                Executor::FixedPriority { cores } if cores > spare => format!(
                    "under the real clock {executor} needs {cores} cores beside the one for all \
                     other threads, and {spare} are left"
                ),
                Executor::FixedPriority { cores } => {
                    spare -= cores;
                    return None;
                }
                _ => return None,
            };
            let (node, _) = members.first()?;
            Some((
                &self.seats[*node],
                format!("{why}: choose the virtual clock"),
            ))
        })
    }
}
