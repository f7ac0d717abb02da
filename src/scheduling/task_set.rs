//! Nodes with one scheduler.
//!
//! A node begins on its own. An executor joins the task sets of its nodes. A clock with threads takes
//! all task sets of a graph ([`Graph::apart`](crate::Graph::apart)). If each node of an executor needs
//! its own thread, the clock splits the task set while its threads run.

use std::collections::BTreeSet;

use super::{
    executors::{
        executor::{Team, Threads},
        ordered::{CallbackOrder, Ordered},
    },
    own::Own,
    task::Task,
    timetable::{Member, SchedulerEvent, TaskState, Timetable},
};
use crate::{
    control::{command::KnobRefusal, knob::Knob},
    node::Job,
    sync::Arc,
    time::Time,
};

/// Nodes with one scheduler: the nodes of an executor, or a node on its own.
pub(crate) struct TaskSet {
    pub(crate) scheduler: Scheduler,
    /// In the order of registration.
    pub(crate) members: Vec<Member>,
    /// The executor, if it is one.
    pub(crate) team: Option<Arc<Team>>,
    /// Turns of its threads so far.
    pub(crate) turns: u64,
}

/// Decides when the nodes of a task set run; see [`SchedulerEvent`].
pub(crate) enum Scheduler {
    /// A node with a thread of its own.
    Own(Box<Own>),
    /// The nodes of an executor.
    Ordered(Ordered),
}

impl Scheduler {
    /// Hears of an event at `timetable.now()`; returns the job to be done now. An alarm that is no longer
    /// of use does no harm.
    #[inline]
    pub(crate) fn on(
        &mut self,
        event: SchedulerEvent,
        timetable: &mut Timetable<'_>,
    ) -> Option<Job> {
        match self {
            Self::Own(own) => own.on(event, timetable),
            Self::Ordered(ordered) => ordered.on(event, timetable),
        }
    }

    /// Returns where a node is in its schedule at run time `now`.
    pub(crate) fn state(&self, member: usize, now: Time) -> TaskState {
        match self {
            Self::Own(own) => own.state(now),
            Self::Ordered(ordered) => ordered.state(member, now),
        }
    }

    /// Checks that the schedule of a node has this knob, and that its value is complete.
    pub(crate) fn check(&self, member: usize, knob: &Knob) -> Result<(), KnobRefusal> {
        match self {
            Self::Own(own) => own.check(knob),
            Self::Ordered(ordered) => ordered.check(member, knob),
        }
    }

    /// Sets a knob of a node's schedule that was checked; returns the one that was in force.
    pub(crate) fn set(
        &mut self,
        member: usize,
        knob: &Knob,
        timetable: &mut Timetable<'_>,
    ) -> Result<Knob, KnobRefusal> {
        match self {
            Self::Own(own) => own.set(knob, timetable),
            Self::Ordered(ordered) => ordered.set(member, knob, timetable),
        }
    }

    fn into_tasks(self) -> Vec<Task> {
        match self {
            Self::Own(own) => vec![own.task],
            Self::Ordered(ordered) => ordered.tasks,
        }
    }
}

impl TaskSet {
    /// Creates the task set of a node on its own.
    pub(crate) fn new(task: Task, member: Member) -> Self {
        Self::alone(Scheduler::Own(Box::new(Own::new(task))), member)
    }

    fn alone(scheduler: Scheduler, member: Member) -> Self {
        Self {
            scheduler,
            members: vec![member],
            team: None,
            turns: 0,
        }
    }

    /// Returns the nodes of an executor that were on their own: one task set, or still one each.
    pub(crate) fn joined(team: Arc<Team>, own: Vec<Self>) -> Vec<Self> {
        let (mut tasks, mut members) = (Vec::<Task>::new(), Vec::new());
        for task_set in own {
            tasks.extend(task_set.scheduler.into_tasks());
            members.extend(task_set.members);
        }
        if team.executor.kind().has_groups {
            tasks.iter_mut().for_each(Task::skip_first);
        }
        match team.order() {
            Some(order) => vec![Self {
                scheduler: Scheduler::Ordered(Ordered::new(tasks, order)),
                members,
                team: Some(team),
                turns: 0,
            }],
            None => tasks
                .into_iter()
                .zip(members)
                .map(|(task, member)| {
                    Self::alone(Scheduler::Own(Box::new(Own::new_let(task))), member)
                })
                .collect(),
        }
    }

    /// Returns the nodes of an executor as a task set each.
    pub(crate) fn split(self, team: &Team) -> Vec<Self> {
        let ordered = |(task, order): (Task, Box<dyn CallbackOrder>)| {
            Scheduler::Ordered(Ordered::new(vec![task], order))
        };
        team.orders_apart(self.scheduler.into_tasks())
            .map(ordered)
            .zip(self.members)
            .map(|(scheduler, member)| Self::alone(scheduler, member))
            .collect()
    }

    /// Returns the threads of the executor under the real clock, if it is one.
    pub(crate) fn threads(&self) -> Option<Threads> {
        Some(self.team.as_ref()?.executor.threads())
    }

    /// Returns the place of each node's priority among all nodes that run here, the highest first.
    pub(crate) fn ranks(&self) -> Vec<usize> {
        let priorities: BTreeSet<u32> = self
            .members
            .iter()
            .filter(|member| !member.remote)
            .map(|member| member.priority)
            .collect();
        let rank = |member: &Member| priorities.range(..member.priority).count();
        self.members.iter().map(rank).collect()
    }

    /// Returns whether it is an executor.
    pub(crate) fn is_executor(&self) -> bool {
        self.team.is_some()
    }

    /// Returns whether it is this node on its own.
    pub(crate) fn is_own(&self, node: usize) -> bool {
        !self.is_executor() && self.members.iter().any(|member| member.node == node)
    }
}
