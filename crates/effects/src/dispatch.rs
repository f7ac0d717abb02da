//! Executors of a graph.

use std::{any::Any, sync::Arc};

use ratelab::{Dispatch, Graph, GraphError, Joined, Periodic, Scheduler, Threads};

use super::{
    callback::Callback,
    events::EventOrder,
    executor::Executor,
    ordered::Ordered,
    own::Own,
    preemptive::{Preemptive, Urgency},
    task::Task,
    windows::WindowOrder,
};

/// Gives a graph executors.
pub trait Executors {
    /// Has an executor run these nodes, which were added before, in the order of their
    /// registration. Each executor has threads of its own, under the real clock as well: there
    /// `fixed-priority` needs real-time priority and cores to spare, and `edf` is refused.
    ///
    /// ```
    /// use std::sync::{Arc, atomic::{AtomicU32, Ordering::Relaxed}};
    /// use ratelab::{Clock, GO_ON, Graph, Hz, Inbox, Time, VirtualClock};
    /// use ratelab_effects::{Callback, Executors};
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
    fn executor(
        &mut self,
        executor: Executor,
        callbacks: impl IntoIterator<Item = Callback>,
    ) -> Result<(), GraphError>;
}

impl Executors for Graph {
    fn executor(
        &mut self,
        kind: Executor,
        callbacks: impl IntoIterator<Item = Callback>,
    ) -> Result<(), GraphError> {
        let callbacks: Vec<Callback> = callbacks.into_iter().collect();
        let names: Vec<String> = callbacks.iter().map(|c| c.node.clone()).collect();
        self.dispatch(Arc::new(Dispatcher { kind, callbacks }), &names)
    }
}

/// An executor with its nodes.
struct Dispatcher {
    kind: Executor,
    /// In the order of registration.
    callbacks: Vec<Callback>,
}

impl Dispatch for Dispatcher {
    fn name(&self) -> String {
        self.kind.to_string()
    }

    fn group(&self, number: usize) -> Option<&str> {
        self.callbacks.get(number)?.group_name()
    }

    fn period_remedy(&self, number: usize) -> Option<&'static str> {
        let deadline = self.callbacks.get(number)?.deadline;
        match self.kind {
            Executor::Let => Some("give it a rate"),
            Executor::Edf { .. } if deadline.is_none() => Some("give it a deadline"),
            _ => None,
        }
    }

    fn can_join(&self, own: &dyn Scheduler) -> bool {
        let own: &dyn Any = own;
        own.is::<Own>() || own.is::<Periodic>()
    }

    fn join(&self, own: Vec<Box<dyn Scheduler>>) -> Joined {
        let mut tasks: Vec<Task> = own.into_iter().filter_map(task_of).collect();
        if self.skips_first() {
            tasks.iter_mut().for_each(Task::skip_first);
        }
        let callbacks = &self.callbacks;
        let preemptive = |tasks, urgency, cores| {
            let order = Preemptive::new(urgency, cores, callbacks);
            Box::new(Ordered::new(tasks, order))
        };
        Joined::Together(match self.kind {
            Executor::Single => Box::new(Ordered::new(tasks, WindowOrder::new(callbacks, 1))),
            Executor::Multi { threads } => {
                Box::new(Ordered::new(tasks, WindowOrder::new(callbacks, threads)))
            }
            Executor::Events => Box::new(Ordered::new(tasks, EventOrder::default())),
            Executor::FixedPriority { cores } => preemptive(tasks, Urgency::Priority, cores),
            Executor::Edf { cores } => preemptive(tasks, Urgency::Deadline, cores),
            Executor::Let => {
                let apart = tasks.into_iter().map(|task| {
                    let own: Box<dyn Scheduler> = Box::new(Own::logical(task));
                    own
                });
                return Joined::Apart(apart.collect());
            }
        })
    }

    fn split(&self, all: Box<dyn Scheduler>) -> Vec<Box<dyn Scheduler>> {
        let all: Box<dyn Any> = all;
        let Ok(all) = all.downcast::<Ordered<Preemptive>>() else {
            return Vec::new();
        };
        let parts = all.tasks.into_iter().zip(&self.callbacks);
        let parts = parts.map(|(task, callback)| {
            let order = Preemptive::new(Urgency::Priority, 1, std::slice::from_ref(callback));
            let part: Box<dyn Scheduler> = Box::new(Ordered::new(vec![task], order));
            part
        });
        parts.collect()
    }

    fn threads(&self) -> Threads {
        match self.kind {
            Executor::Single | Executor::Events | Executor::Let => Threads::Shared(1),
            Executor::Multi { threads } => Threads::Shared(threads),
            Executor::FixedPriority { cores } => Threads::Cores(cores),
            Executor::Edf { .. } => Threads::Virtual,
        }
    }
}

impl Dispatcher {
    /// Whether a timer is due one period after its start for the first time, as in ROS.
    fn skips_first(&self) -> bool {
        match self.kind {
            Executor::Single | Executor::Multi { .. } | Executor::Events => true,
            Executor::FixedPriority { .. } | Executor::Edf { .. } | Executor::Let => false,
        }
    }
}

/// The task of a node that was on its own; `None` for a scheduler that this crate does not know.
fn task_of(own: Box<dyn Scheduler>) -> Option<Task> {
    let own: Box<dyn Any> = own;
    let own = match own.downcast::<Own>() {
        Ok(own) => return Some(own.task),
        Err(other) => other,
    };
    match own.downcast::<Ordered<Preemptive>>() {
        Ok(part) => part.tasks.into_iter().next(),
        Err(own) => Some(Task::new(own.downcast::<Periodic>().ok()?.into_spec())),
    }
}
