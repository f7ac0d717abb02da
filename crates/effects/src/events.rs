//! Execution in the order of the events, as in rclcpp's `EventsExecutor`.
//!
//! One thread and one queue (`events_executor.cpp`, rclcpp `a0a2a06`): a timer joins it
//! when it is due, a message when it arrives, and each is served in turn. A timer whose
//! callback takes longer than its period piles up (`timers_manager.cpp:206-294`); the entry
//! of a message that was dropped since takes nothing.

use std::collections::VecDeque;

use ratelab::{AtInstant, Call, Scheduler, Time};

use super::callback::Callback;

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
    pub(crate) fn new(members: &[(usize, &Callback)]) -> Self {
        Self {
            nodes: members.iter().map(|(node, _)| *node).collect(),
            queue: VecDeque::new(),
            runs: None,
        }
    }
}

impl Scheduler for EventOrder {
    fn due(&mut self, member: usize, plan: &mut AtInstant<'_>) {
        if plan.task(self.nodes[member]).queue_timer() {
            self.queue.push_back(Queued::Timer { member });
        }
    }

    fn arrived(&mut self, member: usize, input: usize, _: &mut AtInstant<'_>) {
        if self.queue.len() < MOST_ENTRIES {
            self.queue.push_back(Queued::Message { member, input });
        }
    }

    fn next(&mut self, _: &mut AtInstant<'_>) -> Option<Call> {
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

    fn began(&mut self, member: usize, ends: Time, plan: &mut AtInstant<'_>) {
        plan.end_at(self.nodes[member], ends);
    }

    fn ended(&mut self, _: usize, _: &mut AtInstant<'_>) {
        self.runs = None;
    }

    fn take_over(&mut self, member: usize, plan: &mut AtInstant<'_>) {
        let node = self.nodes[member];
        let timers = (0..plan.task(node).queued_timers().len()).map(|_| Queued::Timer { member });
        self.queue.extend(timers);
        if let Some(ends) = plan.task(node).running().map(|running| running.ends) {
            self.runs = Some(member);
            plan.end_at(node, ends);
        }
    }

    fn forget(&mut self, member: usize) {
        self.queue.retain(|waiting| waiting.member() != member);
        self.runs.take_if(|runs| *runs == member);
    }

    fn reschedule(&mut self, _: usize) {}
}
