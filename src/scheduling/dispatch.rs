//! What an executor is to a graph.

use super::scheduler::Scheduler;

/// How the nodes of an executor get their turn: it makes their scheduler anew under each clock,
/// and knows what that needs. Its members are known by their number in the order of registration.
pub trait Dispatch: Send + Sync {
    /// Its name, as in a [`NodeTopology`](crate::NodeTopology).
    fn name(&self) -> String;

    /// Name of the group that a member shares with others.
    fn group(&self, number: usize) -> Option<&str>;

    /// What to do about a member without a period, if it needs one.
    fn period_remedy(&self, number: usize) -> Option<&'static str>;

    /// A scheduler for these members; `None` if each has a core of its own, with its outputs at
    /// the end of its period.
    fn scheduler(&self, members: &[Member]) -> Option<Box<dyn Scheduler>>;

    /// Its threads under the real clock.
    fn threads(&self) -> Threads;

    /// Whether its timers wait in line when they are due, instead of being called once, late.
    fn queues_timers(&self) -> bool;

    /// Whether a timer is due one period after its start for the first time, as in ROS.
    fn skips_first(&self) -> bool;
}

/// A node of an executor.
#[derive(Clone, Copy, Debug)]
pub struct Member {
    /// Index of the node among those of the scheduler.
    pub node: usize,
    /// Its number in the order of registration.
    pub number: usize,
}

/// The threads of an executor under the real clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Threads {
    /// So many, for all its nodes.
    Shared(usize),
    /// One for each node, which take turns on so many cores by their priorities.
    Cores(usize),
    /// None: it runs in virtual time only.
    Virtual,
}
