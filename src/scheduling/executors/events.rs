//! Execution in the order of the events, as in rclcpp's `EventsExecutor`.
//!
//! One thread and one queue (`events_executor.cpp`, rclcpp `a0a2a06`): a timer joins it
//! when it is due, a message when it arrives, and each is served in turn. A timer whose
//! callback takes longer than its period piles up (`timers_manager.cpp:206-294`); the entry
//! of a message that was dropped since takes nothing.

use std::collections::VecDeque;

use super::ordered::{Call, CallbackOrder, TaskSetView};

/// The most entries of the queue with messages in them.
const MAX_ENTRIES: usize = 100_000;

/// The callbacks of an executor that serves events in order.
#[derive(Debug, Default)]
pub(crate) struct EventOrder(VecDeque<Call>);

impl CallbackOrder for EventOrder {
    fn released(&mut self, call: Call, _: &mut TaskSetView<'_, '_>) {
        if matches!(call, Call::Timer { .. }) || self.0.len() < MAX_ENTRIES {
            self.0.push_back(call);
        }
    }

    fn next(&mut self, task_set: &mut TaskSetView<'_, '_>) -> Option<Call> {
        let is_free = task_set.running.is_empty();
        is_free.then(|| self.0.pop_front()).flatten()
    }

    fn called(&mut self, member: usize, task_set: &mut TaskSetView<'_, '_>) {
        if task_set.tasks[member].goes_on() {
            self.0.push_front(Call::Messages { member });
        }
    }

    fn forget(&mut self, member: usize) {
        self.0.retain(|waiting| waiting.member() != member);
    }
}
