//! Execution by windows, as in rclcpp's single- and multi-threaded executors.
//!
//! The model of `MultiThreadedExecutor` (rclcpp `a0a2a06`, `multi_threaded_executor.cpp`
//! 82-118, `executor.cpp` 774-914): the threads share one window. A free thread takes the
//! first timer in it whose group is free; else the first other callback whose group is
//! free, and deletes those of busy groups that it passes; else it looks up anew all that
//! is ready in free groups, and tries once more. With one thread this is
//! `SingleThreadedExecutor`.

use std::collections::BTreeSet;

use super::{
    callback::Callback,
    ordered::{Call, CallbackOrder, TaskSetView},
};

/// The callbacks of an executor with one thread or several. A window holds timers before
/// messages, each in the order of registration.
#[derive(Clone, Debug)]
pub(crate) struct WindowOrder {
    threads: usize,
    /// The mutually exclusive group of each node, by its first node.
    groups: Vec<usize>,
    /// The nodes that are being executed.
    running: Vec<usize>,
    /// The callbacks that are ready now.
    ready: BTreeSet<Call>,
    /// Those that were ready at the last look, and were not yet served.
    window: BTreeSet<Call>,
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
            running: Vec::new(),
            ready: BTreeSet::new(),
            window: BTreeSet::new(),
        }
    }

    /// Whether no node of the group of this call runs.
    fn is_free(&self, call: Call) -> bool {
        let group = self.groups[call.member()];
        !self.running.iter().any(|runs| self.groups[*runs] == group)
    }

    /// Takes the first callback of a free group out of the window, and drops the messages before
    /// it.
    fn take(&mut self) -> Option<Call> {
        let mut window = self.window.iter().copied();
        let next = window.find(|call| self.is_free(*call))?;
        let is_timer = |call: &Call| matches!(call, Call::Timer { .. });
        self.window
            .retain(|call| *call > next || is_timer(call) && *call != next);
        Some(next)
    }

    /// Looks up what is ready in free groups.
    fn look(&mut self) {
        let ready = self.ready.iter().copied();
        self.window = ready.filter(|call| self.is_free(*call)).collect();
    }

    /// A subscription whose last message was taken is ready no more.
    fn taken(&mut self, member: usize, task_set: &mut TaskSetView<'_, '_>) {
        for input in 0..task_set.inputs(member) {
            if task_set.oldest_of(member, input).is_none() {
                self.ready.remove(&Call::Message { member, input });
            }
        }
    }

    /// Frees the thread and the group of a node that was being executed.
    fn release(&mut self, member: usize) {
        self.running.retain(|runs| *runs != member);
    }
}

impl CallbackOrder for WindowOrder {
    const QUEUES_TIMERS: bool = false;

    fn due(&mut self, member: usize, _: &mut TaskSetView<'_, '_>) {
        self.ready.insert(Call::Timer { member });
    }

    fn arrived(&mut self, member: usize, input: usize, task_set: &mut TaskSetView<'_, '_>) {
        if task_set.oldest_of(member, input).is_some() {
            self.ready.insert(Call::Message { member, input });
        }
    }

    fn next(&mut self, _: &mut TaskSetView<'_, '_>) -> Option<Call> {
        if self.running.len() == self.threads {
            return None;
        }
        let call = self.take().or_else(|| {
            self.look();
            self.take()
        })?;
        self.running.push(call.member());
        if let Call::Timer { .. } = call {
            self.ready.remove(&call);
        }
        Some(call)
    }

    fn began(&mut self, member: usize, task_set: &mut TaskSetView<'_, '_>) {
        self.taken(member, task_set);
    }

    fn ended(&mut self, member: usize, task_set: &mut TaskSetView<'_, '_>) {
        self.taken(member, task_set);
        self.release(member);
    }

    fn take_over(&mut self, member: usize, task_set: &mut TaskSetView<'_, '_>) {
        if let Some(running) = task_set.task(member).running {
            self.running.push(member);
            task_set.end_at(member, running.ends);
        }
    }

    fn forget(&mut self, member: usize) {
        self.ready.retain(|ready| ready.member() != member);
        self.window.retain(|ready| ready.member() != member);
        self.release(member);
    }

    fn reschedule(&mut self, member: usize) {
        self.ready.remove(&Call::Timer { member });
        self.window.remove(&Call::Timer { member });
    }
}
