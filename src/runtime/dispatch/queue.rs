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
    pub(crate) fn add_end(&mut self, node: usize, at: Time) -> Place {
        let rank = self.nodes[node].rank(node);
        self.agenda.add(at, Phase::Ends, rank, node)
    }
}

/// What a queue of callbacks asks of the nodes, in any kind of time.
pub(crate) trait Nodes {
    /// Whether a message of a topic that triggers a node waits for it.
    fn waits(&mut self, node: usize, input: usize) -> bool;

    /// Number of the topics that trigger a node.
    fn inputs(&self, node: usize) -> usize;

    /// Has the due time of a node's timer wait in line, if there is room; returns the next.
    fn queue_timer(&mut self, node: usize) -> (bool, Time);

    /// Plans the end of a node's tick.
    fn plan_end(&mut self, node: usize, at: Time);

    /// Number of a node's due times in wait.
    fn queued_timers(&self, node: usize) -> usize;

    /// The end of a node's tick, if it is in one.
    fn ends(&self, node: usize) -> Option<Time>;
}

impl Nodes for AtInstant<'_> {
    fn waits(&mut self, node: usize, input: usize) -> bool {
        self.nodes[node].oldest_of(input, self.now).is_some()
    }

    fn inputs(&self, node: usize) -> usize {
        self.nodes[node].inputs()
    }

    fn queue_timer(&mut self, node: usize) -> (bool, Time) {
        let node = &mut self.nodes[node];
        (node.queue_timer(), node.rate.due())
    }

    fn plan_end(&mut self, node: usize, at: Time) {
        self.add_end(node, at);
    }

    fn queued_timers(&self, node: usize) -> usize {
        self.nodes[node].queued_timers().len()
    }

    fn ends(&self, node: usize) -> Option<Time> {
        self.nodes[node].running().map(|running| running.ends)
    }
}

/// A callback to be called now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Call {
    /// The timer of a node.
    Timer { node: usize },
    /// One of its subscriptions, for one message.
    Message { node: usize, input: usize },
    /// Its subscriptions in turn, until a set of messages is complete.
    Messages { node: usize },
}

impl Call {
    /// Index of the node.
    pub(crate) fn node(self) -> usize {
        match self {
            Self::Timer { node } | Self::Message { node, .. } | Self::Messages { node } => node,
        }
    }
}

/// Decides which released callback is called now, with a look at the nodes through `S`. Nodes
/// are known by their number in the order of registration.
pub(crate) trait CallbackQueue<S>: Send {
    /// The timer of a node is due. Returns the next run time at which it will be; `None`
    /// if that depends on the call.
    fn due(&mut self, member: usize, stage: &mut S) -> Option<Time>;

    /// A message has arrived for a node.
    fn arrived(&mut self, member: usize, input: usize, stage: &mut S);

    /// The callback to call now, if there are one and a thread for it.
    fn next(&mut self, stage: &mut S) -> Option<Call>;

    /// A callback was called, and its node ticks until `ends`.
    fn began(&mut self, member: usize, ends: Time, stage: &mut S);

    /// A callback was called and is over.
    fn ended(&mut self, member: usize, stage: &mut S);

    /// Takes a node over as it is after a change of the clock, but for its messages.
    fn take_over(&mut self, member: usize, stage: &mut S);

    /// Forgets what is due or runs of a node that crashed.
    fn forget(&mut self, member: usize);

    /// Forgets that the timer of a node is due, if the call would have set its next due
    /// time: that has changed.
    fn reschedule(&mut self, member: usize);
}
