//! What gives nodes their schedulers, and topics their channels.

use super::scheduler::Scheduler;
use crate::{
    rate::Rate,
    sync::Arc,
    topic::{Channel, Intake},
};

/// A node to be scheduled.
pub struct TaskSpec {
    /// Its name.
    pub name: Arc<str>,
    /// The seed of the run, for random durations.
    pub seed: u64,
    /// Its rate, from the current run time on; without a meaning if messages trigger it.
    pub rate: Rate,
    /// The topics that trigger it.
    pub inputs: Vec<Box<dyn Intake>>,
}

/// What the nodes and topics of a graph can do beyond ticking at a rate and delivering at once.
pub trait Kit: Send + Sync {
    /// The scheduler of a node at a rate.
    fn scheduler(&self, spec: TaskSpec) -> Box<dyn Scheduler>;

    /// What lies between the publishers and the readers of a topic with a knob set; `None`
    /// if nothing does.
    fn channel(&self, topic: &str, seed: u64) -> Option<Box<dyn Channel>>;
}
