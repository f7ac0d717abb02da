//! Execution in the order of the events, as in rclcpp's `EventsExecutor`.
//!
//! One thread and one queue (`events_executor.cpp`, rclcpp `a0a2a06`): a timer joins it
//! when it is due, a message when it arrives, and each is served in turn. A timer whose
//! callback takes longer than its period piles up (`timers_manager.cpp:206-294`); the entry
//! of a message that was dropped since takes nothing.

use std::collections::VecDeque;

use super::queue::{Call, CallbackQueue, Nodes};
use crate::runtime::{executor::Callback, time::Time};

/// The most entries of the queue with messages in them.
const MOST_ENTRIES: usize = 100_000;

/// An entry of the queue.
#[derive(Clone, Copy, Debug)]
enum Queued {
    Timer { member: usize },
    Message { member: usize, input: usize },
}

impl Queued {
    fn member(self) -> usize {
        match self {
            Self::Timer { member } | Self::Message { member, .. } => member,
        }
    }
}

/// The callbacks of an executor that serves events in order.
#[derive(Debug)]
pub(crate) struct EventOrder {
    /// Indices of the nodes, in the order of registration.
    nodes: Vec<usize>,
    queue: VecDeque<Queued>,
    /// The node that is being executed.
    runs: Option<usize>,
}

impl EventOrder {
    pub(crate) fn new(members: &[(usize, Callback)]) -> Self {
        Self {
            nodes: members.iter().map(|(node, _)| *node).collect(),
            queue: VecDeque::new(),
            runs: None,
        }
    }
}

impl<S: Nodes> CallbackQueue<S> for EventOrder {
    fn due(&mut self, member: usize, stage: &mut S) -> Option<Time> {
        let (room, next) = stage.queue_timer(self.nodes[member]);
        if room {
            self.queue.push_back(Queued::Timer { member });
        }
        Some(next)
    }

    fn arrived(&mut self, member: usize, input: usize, _: &mut S) {
        if self.queue.len() < MOST_ENTRIES {
            self.queue.push_back(Queued::Message { member, input });
        }
    }

    fn next(&mut self, _: &mut S) -> Option<Call> {
        if self.runs.is_some() {
            return None;
        }
        let next = self.queue.pop_front()?;
        let member = next.member();
        let node = self.nodes[member];
        self.runs = Some(member);
        Some(match next {
            Queued::Timer { .. } => Call::Timer { node },
            Queued::Message { input, .. } => Call::Message { node, input },
        })
    }

    fn began(&mut self, member: usize, ends: Time, stage: &mut S) {
        stage.plan_end(self.nodes[member], ends);
    }

    fn ended(&mut self, _: usize, _: &mut S) {
        self.runs = None;
    }

    fn take_over(&mut self, member: usize, stage: &mut S) {
        let node = self.nodes[member];
        let timers = (0..stage.queued_timers(node)).map(|_| Queued::Timer { member });
        self.queue.extend(timers);
        if let Some(ends) = stage.ends(node) {
            self.runs = Some(member);
            stage.plan_end(node, ends);
        }
    }

    fn forget(&mut self, member: usize) {
        self.queue.retain(|waiting| waiting.member() != member);
        self.runs.take_if(|runs| *runs == member);
    }

    fn reschedule(&mut self, _: usize) {}
}
