//! An executor with its nodes.

use super::{callback::Callback, executor::Executor, ordered::CallbackOrder};
use crate::scheduling::task::Task;

/// An executor with its nodes.
#[derive(Debug)]
pub(crate) struct Team {
    pub(crate) executor: Executor,
    /// The nodes in the order of registration.
    callbacks: Vec<Callback>,
}

impl Team {
    pub(crate) fn new(executor: Executor, callbacks: Vec<Callback>) -> Self {
        Self {
            executor,
            callbacks,
        }
    }

    /// Returns the names of the nodes.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.callbacks.iter().map(|callback| &*callback.node)
    }

    /// Returns the name of the group that a member shares with others.
    pub(crate) fn group(&self, member: usize) -> Option<&str> {
        self.callbacks.get(member)?.group_name()
    }

    /// Returns what to do about a member without a period, if it needs one.
    pub(crate) fn period_remedy(&self, member: usize) -> Option<&'static str> {
        let callback = self.callbacks.get(member)?;
        self.executor.needs_period(callback).then(|| {
            if self.executor.kind().has_deadlines {
                "give it a deadline"
            } else {
                "give it a rate"
            }
        })
    }

    /// Returns the order of the callbacks of all its nodes; `None` if each has a core of its own.
    pub(crate) fn order(&self) -> Option<Box<dyn CallbackOrder>> {
        let order = self.executor.kind().order?;
        Some(order(&self.callbacks, self.executor.number))
    }

    /// Returns the order for each of these nodes alone, on a core of its own.
    pub(crate) fn orders_apart(
        &self,
        tasks: Vec<Task>,
    ) -> impl Iterator<Item = (Task, Box<dyn CallbackOrder>)> {
        let order = self.executor.kind().order;
        tasks
            .into_iter()
            .zip(&self.callbacks)
            .filter_map(move |(task, callback)| {
                Some((task, order?(std::slice::from_ref(callback), 1)))
            })
    }
}
