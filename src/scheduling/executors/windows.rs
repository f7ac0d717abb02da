//! Execution by windows, as in rclcpp's single- and multi-threaded executors.
//!
//! The model of `MultiThreadedExecutor` (rclcpp `a0a2a06`, `multi_threaded_executor.cpp`
//! 82-118, `executor.cpp` 774-914): the threads share one window. A free thread takes the
//! first timer in it whose group is free; else the first other callback whose group is
//! free, and deletes callbacks of busy groups that it passes; else it looks up anew all that
//! is ready in free groups, and tries once more. With one thread this is
//! `SingleThreadedExecutor`.

use super::ordered::{Call, Callback, CallbackOrder, TaskSetView};

/// The callbacks of an executor with one thread or several. A window holds callbacks that go on
/// with the next set of their message, then timers, then messages, each in the order of
/// registration.
#[derive(Debug)]
pub(crate) struct WindowOrder {
    threads: usize,
    /// The mutually exclusive group of each node, by its first node.
    groups: Vec<usize>,
    /// The callbacks that are ready now.
    ready: CallSet,
    /// The callbacks that were ready at the last look, and were not yet served.
    window: CallSet,
}

/// Calls in their order. There are few, so a list is quicker than a tree.
#[derive(Debug, Default)]
struct CallSet(Vec<Call>);

impl CallSet {
    fn insert(&mut self, call: Call) {
        if let Err(place) = self.0.binary_search(&call) {
            self.0.insert(place, call);
        }
    }

    fn remove(&mut self, call: Call) {
        if let Ok(place) = self.0.binary_search(&call) {
            self.0.remove(place);
        }
    }
}

impl WindowOrder {
    pub(crate) fn new(callbacks: &[Callback], threads: usize) -> Self {
        let groups = callbacks.iter().enumerate().map(|(member, callback)| {
            let group = callback.group_name();
            let first = callbacks.iter().position(|it| it.group_name() == group);
            group.and(first).unwrap_or(member)
        });
        Self {
            threads,
            groups: groups.collect(),
            ready: CallSet::default(),
            window: CallSet::default(),
        }
    }

    /// Takes the first callback of a free group out of the window, and drops the messages before
    /// it.
    fn take(&mut self, running: &[usize]) -> Option<Call> {
        let mut window = self.window.0.iter().copied();
        let next = window.find(|call| is_free(&self.groups, *call, running))?;
        let is_timer = |call: &Call| matches!(call, Call::Timer { .. });
        self.window
            .0
            .retain(|call| *call > next || is_timer(call) && *call != next);
        Some(next)
    }

    /// Looks up what is ready in free groups.
    fn look(&mut self, running: &[usize]) {
        let free = self
            .ready
            .0
            .iter()
            .copied()
            .filter(|call| is_free(&self.groups, *call, running));
        self.window.0.clear();
        self.window.0.extend(free);
    }
}

/// Returns whether no node of the group of this call runs.
fn is_free(groups: &[usize], call: Call, running: &[usize]) -> bool {
    let group = groups[call.member()];
    !running.iter().any(|runs| groups[*runs] == group)
}

impl CallbackOrder for WindowOrder {
    fn queues_timers(&self) -> bool {
        false
    }

    fn released(&mut self, call: Call, task_set: &mut TaskSetView<'_, '_>) {
        let (now, trigger) = (
            task_set.timetable.now(),
            &task_set.tasks[call.member()].trigger,
        );
        let is_gone = match call {
            Call::Message { input, .. } => trigger
                .as_ref()
                .is_none_or(|trigger| trigger.oldest_of(input, now).is_none()),
            _ => false,
        };
        if !is_gone {
            self.ready.insert(call);
        }
    }

    fn next(&mut self, task_set: &mut TaskSetView<'_, '_>) -> Option<Call> {
        let running = task_set.running;
        if running.len() == self.threads {
            return None;
        }
        let call = self.take(running).or_else(|| {
            self.look(running);
            self.take(running)
        })?;
        if let Call::Timer { .. } = call {
            self.ready.remove(call);
        }
        Some(call)
    }

    /// A subscription whose last message was taken is ready no more.
    fn called(&mut self, member: usize, task_set: &mut TaskSetView<'_, '_>) {
        if task_set.tasks[member].goes_on() {
            self.window.insert(Call::Messages { member });
        }
        let now = task_set.timetable.now();
        if let Some(trigger) = &task_set.tasks[member].trigger {
            let inputs = 0..trigger.inputs();
            for input in inputs.filter(|input| trigger.oldest_of(*input, now).is_none()) {
                self.ready.remove(Call::Message { member, input });
            }
        }
    }

    fn forget(&mut self, member: usize) {
        self.ready.0.retain(|ready| ready.member() != member);
        self.window.0.retain(|ready| ready.member() != member);
    }

    fn reschedule(&mut self, member: usize) {
        self.ready.remove(Call::Timer { member });
        self.window.remove(Call::Timer { member });
    }
}
