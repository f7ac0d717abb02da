//! What an executor is to a graph.

use super::scheduler::Scheduler;

/// How the nodes of an executor get their turn. Its members are known by their number in the
/// order of registration.
pub trait Dispatch: Send + Sync {
    /// Its name, as in a [`NodeTopology`](crate::NodeTopology).
    fn name(&self) -> String;

    /// Name of the group that a member shares with others.
    fn group(&self, member: usize) -> Option<&str>;

    /// What to do about a member without a period, if it needs one.
    fn period_remedy(&self, member: usize) -> Option<&'static str>;

    /// Its threads under the real clock.
    fn threads(&self) -> Threads;

    /// Whether it can join a node that has this scheduler on its own.
    fn can_join(&self, own: &dyn Scheduler) -> bool;

    /// The scheduler of all members in place of those that each had on its own; or one for each
    /// again, if the members stay apart.
    fn join(&self, own: Vec<Box<dyn Scheduler>>) -> Joined;

    /// A scheduler for each member alone, for [`Threads::Cores`].
    fn split(&self, all: Box<dyn Scheduler>) -> Vec<Box<dyn Scheduler>>;
}

/// Schedulers of the members of an executor.
pub enum Joined {
    /// One for all.
    Together(Box<dyn Scheduler>),
    /// One for each.
    Apart(Vec<Box<dyn Scheduler>>),
}

/// The threads of an executor under the real clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Threads {
    /// So many, for all its nodes.
    Shared(usize),
    /// One for each node, which take turns on so many cores by their deadlines, or else by their
    /// priorities.
    Cores(usize),
}
