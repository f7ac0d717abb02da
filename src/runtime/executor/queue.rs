//! What an executor is to the virtual clock: a queue between release and start.

use super::agenda::{Agenda, Phase, Place};
use crate::runtime::{scheduled_node::ScheduledNode, time::Time};

/// The run at an instant, as an executor sees it.
pub(crate) struct AtInstant<'a> {
    pub(crate) now: Time,
    pub(crate) nodes: &'a mut [ScheduledNode],
    pub(crate) agenda: &'a mut Agenda,
}

impl AtInstant<'_> {
    /// Plans the end of a node's tick.
    pub(crate) fn plan_end(&mut self, node: usize, at: Time) -> Place {
        let rank = self.nodes[node].rank(node);
        self.agenda.add(at, Phase::Ends, rank, node)
    }
}

/// A callback to be called now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Call {
    /// The timer of a node, due at this run time.
    Timer { node: usize, due: Time },
    /// One of its subscriptions, for one message.
    Message { node: usize, input: usize },
    /// Its subscriptions in turn, until a set of messages is complete.
    Messages { node: usize },
}

impl Call {
    /// Index of the node.
    pub(crate) fn node(self) -> usize {
        match self {
            Self::Timer { node, .. } | Self::Message { node, .. } | Self::Messages { node } => node,
        }
    }
}

/// Decides which released callback is called now. Nodes are known by their number in the
/// order of registration.
pub(crate) trait CallbackQueue: Send {
    /// The timer of a node is due. Returns the next run time at which it will be; `None`
    /// if that depends on the call.
    fn due(&mut self, member: usize, stage: &mut AtInstant<'_>) -> Option<Time>;

    /// A message has arrived for a node.
    fn arrived(&mut self, member: usize, input: usize, stage: &mut AtInstant<'_>);

    /// The callback to call now, if there are one and a thread for it.
    fn next(&mut self, stage: &mut AtInstant<'_>) -> Option<Call>;

    /// A callback was called, and its node ticks until `ends`.
    fn began(&mut self, member: usize, ends: Time, stage: &mut AtInstant<'_>);

    /// A callback was called and is over.
    fn ended(&mut self, member: usize, stage: &mut AtInstant<'_>);

    /// Forgets what is due or runs of a node that crashed.
    fn forget(&mut self, member: usize);

    /// Forgets that the timer of a node is due, if the call would have set its next due
    /// time: that has changed.
    fn reschedule(&mut self, member: usize);
}
