//! Execution by windows, as in rclcpp's single- and multi-threaded executors.
//!
//! The model of `MultiThreadedExecutor` (rclcpp `a0a2a06`, `multi_threaded_executor.cpp`
//! 82-118, `executor.cpp` 774-914): the threads share one window. A free thread takes the
//! first timer in it whose group is free; else the first other callback whose group is
//! free, and deletes those of busy groups that it passes; else it looks up anew all that
//! is ready in free groups, and tries once more. With one thread this is
//! `SingleThreadedExecutor`.

use std::collections::BTreeSet;

use ratelab::Time;

use super::{
    callback::Callback,
    groups::Groups,
    ordered::{Call, CallbackOrder, TaskSetView},
};

/// A callback by its place in a window: timers before subscriptions, in the order of
/// registration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Ready {
    Timer { member: usize },
    Subscription { member: usize, input: usize },
}

impl Ready {
    fn member(self) -> usize {
        match self {
            Self::Timer { member } | Self::Subscription { member, .. } => member,
        }
    }
}

/// The callbacks of an executor with one thread or several.
#[derive(Clone, Debug)]
pub(crate) struct WindowOrder {
    groups: Groups,
    /// Number of threads that execute nothing.
    idle: usize,
    /// Whether each node is being executed.
    runs: Vec<bool>,
    /// The callbacks that are ready now.
    ready: BTreeSet<Ready>,
    /// Those that were ready at the last look, and were not yet served.
    window: BTreeSet<Ready>,
}

impl WindowOrder {
    pub(crate) fn new(callbacks: &[Callback], threads: usize) -> Self {
        Self {
            groups: Groups::new(callbacks.iter()),
            idle: threads,
            runs: vec![false; callbacks.len()],
            ready: BTreeSet::new(),
            window: BTreeSet::new(),
        }
    }

    /// The next callback of the window.
    fn take(&mut self) -> Option<Ready> {
        let timers = self.window.iter();
        let mut timers = timers.take_while(|ready| matches!(ready, Ready::Timer { .. }));
        let timer = timers
            .find(|timer| self.groups.is_free(timer.member()))
            .copied();
        if let Some(timer) = timer {
            self.window.remove(&timer);
            return Some(timer);
        }
        let first = Ready::Subscription {
            member: 0,
            input: 0,
        };
        let mut others = self.window.split_off(&first);
        let next = loop {
            match others.pop_first() {
                Some(next) if !self.groups.is_free(next.member()) => {}
                next => break next,
            }
        };
        self.window.append(&mut others);
        next
    }

    /// Looks up what is ready in free groups.
    fn look(&mut self) {
        let ready = self.ready.iter().copied();
        let free = ready.filter(|ready| self.groups.is_free(ready.member()));
        self.window = free.collect();
    }
}

impl CallbackOrder for WindowOrder {
    const QUEUES_TIMERS: bool = false;

    fn due(&mut self, member: usize, _: &mut TaskSetView<'_, '_>) {
        self.ready.insert(Ready::Timer { member });
    }

    fn arrived(&mut self, member: usize, input: usize, task_set: &mut TaskSetView<'_, '_>) {
        if task_set.oldest_of(member, input).is_some() {
            self.ready.insert(Ready::Subscription { member, input });
        }
    }

    fn next(&mut self, _: &mut TaskSetView<'_, '_>) -> Option<Call> {
        if self.idle == 0 {
            return None;
        }
        let ready = self.take().or_else(|| {
            self.look();
            self.take()
        })?;
        let member = ready.member();
        self.occupy(member);
        match ready {
            Ready::Timer { .. } => {
                self.ready.remove(&ready);
                Some(Call::Timer { member })
            }
            Ready::Subscription { input, .. } => Some(Call::Message { member, input }),
        }
    }

    fn began(&mut self, member: usize, ends: Time, task_set: &mut TaskSetView<'_, '_>) {
        self.taken(member, task_set);
        task_set.end_at(member, ends);
    }

    fn ended(&mut self, member: usize, task_set: &mut TaskSetView<'_, '_>) {
        self.taken(member, task_set);
        self.release(member);
    }

    fn take_over(&mut self, member: usize, task_set: &mut TaskSetView<'_, '_>) {
        if let Some(running) = task_set.task(member).running {
            self.occupy(member);
            task_set.end_at(member, running.ends);
        }
    }

    fn forget(&mut self, member: usize) {
        self.ready.retain(|ready| ready.member() != member);
        self.window.retain(|ready| ready.member() != member);
        self.release(member);
    }

    fn reschedule(&mut self, member: usize) {
        self.ready.remove(&Ready::Timer { member });
        self.window.remove(&Ready::Timer { member });
    }
}

impl WindowOrder {
    /// Occupies a thread and the group of a node.
    fn occupy(&mut self, member: usize) {
        self.idle -= 1;
        self.runs[member] = true;
        self.groups.set_busy(member, true);
    }

    /// Frees the thread and the group of a node that was being executed.
    fn release(&mut self, member: usize) {
        if std::mem::take(&mut self.runs[member]) {
            self.idle += 1;
            self.groups.set_busy(member, false);
        }
    }

    /// A subscription whose last message was taken is ready no more.
    fn taken(&mut self, member: usize, task_set: &mut TaskSetView<'_, '_>) {
        for input in 0..task_set.inputs(member) {
            if task_set.oldest_of(member, input).is_none() {
                self.ready.remove(&Ready::Subscription { member, input });
            }
        }
    }
}
