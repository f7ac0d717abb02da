//! Nodes with one scheduler.
//!
//! A node begins on its own. An executor has the task sets of its nodes joined
//! ([`Dispatch::join`]). A clock with threads takes all task sets of a graph
//! ([`Graph::apart`](crate::Graph::apart)); where each node of an executor is to have a thread, it
//! has that task set split ([`Dispatch::split`]) until its threads have ended.

use std::collections::BTreeSet;

use super::{
    dispatch::{Dispatch, Joined},
    scheduler::{Member, Scheduler},
};
use crate::sync::Arc;

/// Nodes with one scheduler: those of an executor, or a node on its own.
pub(crate) struct TaskSet {
    pub(crate) scheduler: Box<dyn Scheduler>,
    /// In the order of registration.
    pub(crate) members: Vec<Member>,
    /// The executor, if it is one.
    pub(crate) dispatch: Option<Arc<dyn Dispatch>>,
    /// Turns of its threads so far.
    pub(crate) turns: u64,
}

impl TaskSet {
    /// A node on its own.
    pub(crate) fn of(scheduler: Box<dyn Scheduler>, member: Member) -> Self {
        Self {
            scheduler,
            members: vec![member],
            dispatch: None,
            turns: 0,
        }
    }

    /// The nodes of an executor that were on their own: one task set, or still one each.
    pub(crate) fn joined(dispatch: Arc<dyn Dispatch>, own: Vec<Self>) -> Vec<Self> {
        let own = own
            .into_iter()
            .map(|task_set| (task_set.scheduler, task_set.members));
        let (schedulers, members): (Vec<_>, Vec<_>) = own.unzip();
        let members = members.into_iter().flatten();
        match dispatch.join(schedulers) {
            Joined::Together(scheduler) => vec![Self {
                scheduler,
                members: members.collect(),
                dispatch: Some(dispatch),
                turns: 0,
            }],
            Joined::Apart(schedulers) => Self::each(schedulers, members),
        }
    }

    /// The nodes of an executor as a task set each.
    pub(crate) fn split(self, dispatch: &dyn Dispatch) -> Vec<Self> {
        Self::each(dispatch.split(self.scheduler), self.members)
    }

    fn each(
        schedulers: Vec<Box<dyn Scheduler>>,
        members: impl IntoIterator<Item = Member>,
    ) -> Vec<Self> {
        let apart = schedulers.into_iter().zip(members);
        apart.map(|(own, member)| Self::of(own, member)).collect()
    }

    /// The place of each node's priority among those of all that run here, the highest first.
    pub(crate) fn ranks(&self) -> Vec<usize> {
        let here = self.members.iter().filter(|member| !member.remote);
        let priorities: BTreeSet<u32> = here.map(|member| member.priority).collect();
        let rank = |member: &Member| priorities.range(..member.priority).count();
        self.members.iter().map(rank).collect()
    }

    /// Whether it is an executor.
    pub(crate) fn is_executor(&self) -> bool {
        self.dispatch.is_some()
    }

    /// Whether it is this node on its own.
    pub(crate) fn is_own(&self, node: usize) -> bool {
        !self.is_executor() && self.members.iter().any(|member| member.node == node)
    }
}
