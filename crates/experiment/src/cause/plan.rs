//! The causes that come of how actions are planned ahead, or of what no plan knows.

use std::time::Duration;

use ratelab::Time;
use ratelab_system::Spoiler;

use super::{AgeOwner, Facts};

/// The newest plan and its playing, as far as they tell why a run is lost.
#[derive(Clone, Copy, Debug)]
pub struct PlanFacts {
    /// Number of its actions.
    pub actions: usize,
    /// Run time of the last moment without an action.
    pub stalled: Option<Time>,
    /// Number of actions that it takes until the next plan is there.
    pub needed: usize,
    /// The time from its making on after which it was taken.
    pub delay: Duration,
    /// The last expected delay with an error of an action's period or more, and the real one.
    pub missed: Option<[Duration; 2]>,
}

impl Facts<'_> {
    /// Returns what may be wrong with the plans and their playing; nothing without plans.
    pub(super) fn planners(&self) -> Vec<AgeOwner> {
        let Some((plan, planning)) = self.plan.zip(self.system.robot().planning()) else {
            return Vec::new();
        };
        let publisher = |topic| self.graph.topic(topic)?.publishers.first().copied();
        let Some(plans) = publisher(planning.plans) else {
            return Vec::new();
        };
        if self.graph.nodes[plans].crashed || self.hang(plans).is_some() {
            return Vec::new(); // Of a node that makes no more plans, that is the cause.
        }
        let stalls = plan.stalled.is_some_and(|at| self.late.from < at);
        let stall = publisher(planning.steps).filter(|_| stalls);
        let misses = plan.missed.map(|_| AgeOwner::Delay(plans));
        stall
            .map(AgeOwner::Stall)
            .into_iter()
            .chain(self.spoiled())
            .chain(misses)
            .collect()
    }

    /// Returns the parameters in force that may spoil the run.
    pub(super) fn spoiled(&self) -> Vec<AgeOwner> {
        let planning = self.system.robot().planning();
        let wrong = planning
            .map_or(&[][..], |planning| planning.spoilers)
            .iter()
            .enumerate()
            .filter(|(_, spoiler)| self.value(spoiler) != spoiler.sound);
        let owner = |(number, spoiler): (usize, &Spoiler)| {
            let node = self.lineage.topology().node(spoiler.node)?;
            Some(AgeOwner::Spoiler { node, number })
        };
        wrong.filter_map(owner).collect()
    }

    /// Returns the value of a parameter in force; without plans a sound one, if none is set.
    pub(super) fn value(&self, spoiler: &Spoiler) -> &str {
        let unset = self.plan.map_or(spoiler.sound, |_| spoiler.usual);
        let set = self.setup.parameter(spoiler.node, spoiler.name);
        set.unwrap_or(unset)
    }
}
