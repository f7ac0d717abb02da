//! Executors of a graph.

use std::{any::Any, sync::Arc};

use ratelab::{Dispatch, Graph, GraphError, Joined, Periodic, Scheduler, Threads};

use super::{callback::Callback, executor::Executor, ordered::Ordered};
use crate::nodes::{own::Own, task::Task};

/// Gives a graph executors.
pub trait Executors {
    /// Has an executor run these nodes, which were added before, in the order of their
    /// registration. Each executor has threads of its own, under the real clock as well: there
    /// `fixed-priority` and `edf` need real-time priority and cores to spare.
    ///
    /// ```
    /// use std::sync::{Arc, atomic::{AtomicU32, Ordering::Relaxed}};
    /// use ratelab::{Clock, Graph, Hz, Inbox, Tick, Time, VirtualClock};
    /// use ratelab_effects::{Callback, Executors};
    ///
    /// let (mut graph, ticks) = (Graph::new(), Arc::new(AtomicU32::new(0)));
    /// for node in ["lidar", "planner"] {
    ///     let ticks = ticks.clone();
    ///     graph.node(node, Hz::new(10.0)?, 0, |_| move |_: &mut Tick| {
    ///         ticks.fetch_add(1, Relaxed);
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
    fn executor(
        &mut self,
        executor: Executor,
        callbacks: impl IntoIterator<Item = Callback>,
    ) -> Result<(), GraphError>;
}

impl Executors for Graph {
    fn executor(
        &mut self,
        executor: Executor,
        callbacks: impl IntoIterator<Item = Callback>,
    ) -> Result<(), GraphError> {
        let callbacks: Vec<Callback> = callbacks.into_iter().collect();
        let names: Vec<String> = callbacks.iter().map(|c| c.node.clone()).collect();
        self.dispatch(
            Arc::new(Dispatcher {
                executor,
                callbacks,
            }),
            &names,
        )
    }
}

/// An executor with its nodes.
struct Dispatcher {
    executor: Executor,
    /// In the order of registration.
    callbacks: Vec<Callback>,
}

impl Dispatch for Dispatcher {
    fn name(&self) -> String {
        self.executor.to_string()
    }

    fn group(&self, number: usize) -> Option<&str> {
        self.callbacks.get(number)?.group_name()
    }

    fn period_remedy(&self, number: usize) -> Option<&'static str> {
        let needs = self.executor.needs_period(self.callbacks.get(number)?);
        needs.then(|| match self.executor.kind().has_deadlines {
            true => "give it a deadline",
            false => "give it a rate",
        })
    }

    fn can_join(&self, own: &dyn Scheduler) -> bool {
        let own: &dyn Any = own;
        own.is::<Own>() || own.is::<Periodic>()
    }

    fn join(&self, own: Vec<Box<dyn Scheduler>>) -> Joined {
        let mut tasks: Vec<Task> = own.into_iter().filter_map(task_of).collect();
        if self.executor.kind().has_groups {
            tasks.iter_mut().for_each(Task::skip_first);
        }
        match self.executor.kind().order {
            Some(order) => {
                let order = order(&self.callbacks, self.executor.number);
                Joined::Together(Box::new(Ordered::new(tasks, order)))
            }
            None => {
                let apart = tasks.into_iter().map(|task| {
                    let mut own = Own::new(task);
                    own.is_let = true;
                    boxed(own)
                });
                Joined::Apart(apart.collect())
            }
        }
    }

    fn split(&self, all: Box<dyn Scheduler>) -> Vec<Box<dyn Scheduler>> {
        let all: Box<dyn Any> = all;
        let (Ok(all), Some(order)) = (all.downcast::<Ordered>(), self.executor.kind().order) else {
            return Vec::new();
        };
        let parts = all.tasks.into_iter().zip(&self.callbacks);
        let parts = parts.map(|(task, callback)| {
            let order = order(std::slice::from_ref(callback), 1);
            boxed(Ordered::new(vec![task], order))
        });
        parts.collect()
    }

    fn threads(&self) -> Threads {
        (self.executor.kind().threads)(self.executor.number)
    }
}

fn boxed(scheduler: impl Scheduler) -> Box<dyn Scheduler> {
    Box::new(scheduler)
}

/// The task of a node that was on its own; `None` for a scheduler that this crate does not know.
fn task_of(own: Box<dyn Scheduler>) -> Option<Task> {
    let own: Box<dyn Any> = own;
    let own = match own.downcast::<Own>() {
        Ok(own) => return Some(own.task),
        Err(other) => other,
    };
    match own.downcast::<Ordered>() {
        Ok(part) => part.tasks.into_iter().next(),
        Err(own) => Some(Task::new(own.downcast::<Periodic>().ok()?.into_spec())),
    }
}
