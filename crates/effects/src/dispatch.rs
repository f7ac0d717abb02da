//! Executors of a graph.

use std::sync::Arc;

use ratelab::{Dispatch, Graph, GraphError, Member, Scheduler, Threads};

use super::{
    callback::Callback,
    events::EventOrder,
    executor::Executor,
    preemptive::{Preemptive, Urgency},
    windows::WindowOrder,
};

/// Gives a graph executors.
pub trait Executors {
    /// Has an executor run these nodes, which were added before, in the order of their
    /// registration. Each executor has threads of its own, under the real clock as well: there
    /// `fixed-priority` needs
    /// [`RealtimePriority`](ratelab::RealtimePriority) and cores to spare, and
    /// `edf` is refused.
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

    fn scheduler(&self, members: &[Member]) -> Option<Box<dyn Scheduler>> {
        let known = members.iter().filter_map(|member| {
            let callback = self.callbacks.get(member.number)?;
            Some((member.node, callback))
        });
        let members: Vec<(usize, &Callback)> = known.collect();
        let preemptive = |urgency, cores| {
            let tasks = members.iter().map(|(node, c)| (*node, c.deadline));
            Some(Box::new(Preemptive::new(urgency, cores, tasks)) as Box<dyn Scheduler>)
        };
        match self.kind {
            Executor::Single => Some(Box::new(WindowOrder::new(&members, 1))),
            Executor::Multi { threads } => Some(Box::new(WindowOrder::new(&members, threads))),
            Executor::Events => Some(Box::new(EventOrder::new(&members))),
            Executor::FixedPriority { cores } => preemptive(Urgency::Priority, cores),
            Executor::Edf { cores } => preemptive(Urgency::Deadline, cores),
            Executor::Let => None,
        }
    }

    fn threads(&self) -> Threads {
        match self.kind {
            Executor::Single | Executor::Events | Executor::Let => Threads::Shared(1),
            Executor::Multi { threads } => Threads::Shared(threads),
            Executor::FixedPriority { cores } => Threads::Cores(cores),
            Executor::Edf { .. } => Threads::Virtual,
        }
    }

    fn queues_timers(&self) -> bool {
        match self.kind {
            Executor::Events | Executor::FixedPriority { .. } | Executor::Edf { .. } => true,
            Executor::Single | Executor::Multi { .. } | Executor::Let => false,
        }
    }

    fn skips_first(&self) -> bool {
        match self.kind {
            Executor::Single | Executor::Multi { .. } | Executor::Events => true,
            Executor::FixedPriority { .. } | Executor::Edf { .. } | Executor::Let => false,
        }
    }
}
