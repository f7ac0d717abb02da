//! What the nodes of a graph get of this crate.

use std::sync::Arc;

use ratelab::{Channel, Kit, Matching, Release, Scheduler, TaskSpec};

use crate::{
    links::channel::LinkChannel,
    nodes::{own::Own, task::Task},
    triggers::{matching::Match, trigger::Trigger},
};

/// Gives the nodes of a graph costs, lateness, offsets, faults and wrong clocks, and its topics
/// links.
///
/// ```
/// use ratelab::{Graph, Hz, Tick};
/// use ratelab_effects::Effects;
///
/// let mut graph = Graph::with(Effects);
/// graph.node("policy", Hz::new(50.0)?, 0, |_| |_: &mut Tick| {})?;
/// assert_eq!(graph.set(&"takes policy 30".parse()?)?, "none");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Effects;

impl Kit for Effects {
    fn scheduler(&self, spec: TaskSpec) -> Box<dyn Scheduler> {
        Box::new(Own::new(Task::new(spec)))
    }

    fn channel(&self, topic: &str, seed: u64) -> Option<Box<dyn Channel>> {
        Some(Box::new(LinkChannel::new(seed, topic)))
    }
}

impl Matching for Match {
    fn scheduler(&self, mut spec: TaskSpec) -> Box<dyn Scheduler> {
        let inputs = std::mem::take(&mut spec.inputs);
        let mut task = Task::new(spec);
        task.trigger = Some(Trigger::new(*self, inputs));
        Box::new(Own::new(task))
    }
}

impl From<Match> for Release {
    fn from(matching: Match) -> Self {
        Self::On(Arc::new(matching))
    }
}
