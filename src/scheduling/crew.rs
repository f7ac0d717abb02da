//! Nodes with one scheduler.

use super::{
    dispatch::{Dispatch, Joined},
    member::Member,
    scheduler::Scheduler,
};
use crate::sync::Arc;

/// Nodes with one scheduler: those of an executor, or a node on its own.
pub(crate) struct Crew {
    pub(crate) scheduler: Box<dyn Scheduler>,
    /// In the order of registration.
    pub(crate) members: Vec<Member>,
    /// The executor, if it is one.
    pub(crate) dispatch: Option<Arc<dyn Dispatch>>,
    /// Turns of its threads so far.
    pub(crate) turns: u64,
}

impl Crew {
    /// A node on its own.
    pub(crate) fn of(scheduler: Box<dyn Scheduler>, member: Member) -> Self {
        let (members, dispatch) = (vec![member], None);
        Self {
            scheduler,
            members,
            dispatch,
            turns: 0,
        }
    }

    /// The nodes of an executor that were on their own: one crew, or still one each.
    pub(crate) fn joined(
        dispatch: Arc<dyn Dispatch>,
        own: Vec<Box<dyn Scheduler>>,
        members: Vec<Member>,
    ) -> Vec<Self> {
        match dispatch.join(own) {
            Joined::Together(scheduler) => vec![Self {
                scheduler,
                members,
                dispatch: Some(dispatch),
                turns: 0,
            }],
            Joined::Apart(schedulers) => {
                let apart = schedulers.into_iter().zip(members);
                apart.map(|(own, member)| Self::of(own, member)).collect()
            }
        }
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
