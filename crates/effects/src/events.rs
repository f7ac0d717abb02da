//! Execution in the order of the events, as in rclcpp's `EventsExecutor`.
//!
//! One thread and one queue (`events_executor.cpp`, rclcpp `a0a2a06`): a timer joins it
//! when it is due, a message when it arrives, and each is served in turn. A timer whose
//! callback takes longer than its period piles up (`timers_manager.cpp:206-294`); the entry
//! of a message that was dropped since takes nothing.

use std::collections::VecDeque;

use super::ordered::{Call, CallbackOrder, TaskSetView};

/// The most entries of the queue with messages in them.
const MOST_ENTRIES: usize = 100_000;

/// The callbacks of an executor that serves events in order.
#[derive(Clone, Debug, Default)]
pub(crate) struct EventOrder {
    queue: VecDeque<Call>,
    /// The node that is being executed.
    runs: Option<usize>,
}

impl CallbackOrder for EventOrder {
    const QUEUES_TIMERS: bool = true;

    fn due(&mut self, member: usize, task_set: &mut TaskSetView<'_, '_>) {
        if task_set.queue_timer(member) {
            self.queue.push_back(Call::Timer { member });
        }
    }

    fn arrived(&mut self, member: usize, input: usize, _: &mut TaskSetView<'_, '_>) {
        if self.queue.len() < MOST_ENTRIES {
            self.queue.push_back(Call::Message { member, input });
        }
    }

    fn next(&mut self, _: &mut TaskSetView<'_, '_>) -> Option<Call> {
        if self.runs.is_some() {
            return None;
        }
        let next = self.queue.pop_front()?;
        self.runs = Some(next.member());
        Some(next)
    }

    fn ended(&mut self, _: usize, _: &mut TaskSetView<'_, '_>) {
        self.runs = None;
    }

    fn take_over(&mut self, member: usize, task_set: &mut TaskSetView<'_, '_>) {
        let task = task_set.task(member);
        let timers = task.queued_timers().map(|_| Call::Timer { member });
        self.queue.extend(timers);
        if let Some(running) = task.running {
            self.runs = Some(member);
            task_set.end_at(member, running.ends);
        }
    }

    fn forget(&mut self, member: usize) {
        self.queue.retain(|waiting| waiting.member() != member);
        self.runs.take_if(|runs| *runs == member);
    }
}
