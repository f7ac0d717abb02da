//! A task set with a schedule of its own, which its threads share.

use crate::{
    control::{command::ClockKind, writer::RunWriter},
    node::NodeSlot,
    scheduling::{Schedule, TaskSet, executors::executor::Threads},
    shared::{Shared, SharedGuard},
    sync::Mutex,
};

/// Where the nodes of an executor take turns by priority.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CoreClaim {
    /// Number of the executor, of all executors with cores.
    pub executor: usize,
    /// Number of its cores.
    pub cores: usize,
    /// Place of the node's priority within the executor, the highest first.
    pub rank: usize,
}

/// A task set with a schedule of its own.
pub(crate) struct SharedSchedule<'g> {
    schedule: Shared<Schedule>,
    /// The slots of all nodes of the graph.
    pub(crate) slots: &'g [Mutex<NodeSlot>],
    pub(crate) state: RunWriter,
    /// Index of the node that was registered first.
    pub(crate) first: usize,
    /// Number of threads; none if all nodes run in other processes.
    pub(crate) threads: usize,
    /// The cores that its thread shares with the threads of other nodes.
    pub(crate) claim: Option<CoreClaim>,
}

impl<'g> SharedSchedule<'g> {
    pub(crate) fn new(
        task_set: TaskSet,
        claim: Option<CoreClaim>,
        slots: &'g [Mutex<NodeSlot>],
        state: RunWriter,
    ) -> Self {
        let threads = match task_set.threads() {
            Some(Threads::Shared(threads)) => threads,
            _ => 1,
        };
        let here = task_set
            .members
            .iter()
            .filter(|member| !member.remote)
            .count();
        let first = task_set.members.first();
        let name = first.map_or("", |member| &*member.name);
        Self {
            // A node ticks once at a time: more threads would have nothing to do.
            threads: threads.min(here),
            claim,
            first: first.map_or(0, |member| member.node),
            slots,
            state,
            schedule: Shared::after(
                task_set.turns,
                format!("the executor of {name}"),
                Schedule::new(ClockKind::Real, vec![task_set]),
            ),
        }
    }

    /// Returns its task set, with the turns of its threads.
    pub(crate) fn into_task_set(self) -> Option<TaskSet> {
        let turns = self.schedule.turns();
        let task_set = self.schedule.peek().take_task_sets().pop()?;
        Some(TaskSet { turns, ..task_set })
    }

    /// Returns whether several threads share the schedule, in turns.
    pub(crate) fn is_shared(&self) -> bool {
        self.threads > 1
    }

    /// Returns the schedule, for a turn of a thread.
    pub(crate) fn turn(&self) -> SharedGuard<'_, Schedule> {
        if self.is_shared() {
            self.schedule.lock()
        } else {
            self.schedule.peek()
        }
    }

    /// Returns the schedule, for a look.
    pub(crate) fn peek(&self) -> SharedGuard<'_, Schedule> {
        self.schedule.peek()
    }
}
