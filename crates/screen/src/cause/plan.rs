//! The owners of an age that come of how actions are planned ahead.

use super::{AgeReason, Facts, Owner};
use crate::frame::Strain;

impl Facts<'_> {
    /// The node that had no action to play of late, and the one that plans without what is
    /// played meanwhile, though the age is beyond its limit.
    pub(super) fn planners(&self) -> Vec<Owner> {
        let Some((plan, planning)) = self.plan.zip(self.system.about().planning) else {
            return Vec::new();
        };
        let publisher = |topic| self.graph.topic(topic)?.publishers.first().copied();
        let plans = publisher(planning.plans);
        // Of a node that makes no more plans, that is the cause.
        let works =
            plans.is_some_and(|node| !self.graph.nodes[node].crashed && self.hang(node).is_none());
        let stalls = works && plan.stalled.is_some_and(|at| self.late.0 < at);
        let is_old = self.age.is_none_or(|age| age.strain() != Strain::Borne);
        let stall = publisher(planning.steps).filter(|_| stalls);
        let blind = plans.filter(|_| works && is_old && !plan.knows);
        let stall = stall.map(|node| AgeReason::Stall.at(node));
        stall
            .into_iter()
            .chain(blind.map(|node| AgeReason::Blind.at(node)))
            .collect()
    }
}
