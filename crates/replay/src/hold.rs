//! Holds an overlap between two of its operations, to be looked at.

use std::sync::PoisonError;

use ratelab::sync::{Condvar, Mutex, MutexGuard, lock};

/// The number of operations of an overlap that is not held.
const ALL: usize = usize::MAX;

/// An overlap whose operations are done one by one, in the order of the plan.
#[derive(Debug, Default)]
pub(crate) struct Hold {
    state: Mutex<HoldState>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct HoldState {
    /// The threads of the operations, in order; `None` until the run is there.
    order: Option<Vec<usize>>,
    /// Operations that may be done.
    allowed: usize,
    /// Operations that were begun.
    done: usize,
    /// Threads that are neither held nor at the end of the overlap.
    running: usize,
    /// Whether nobody looks at it any more.
    ended: bool,
}

impl HoldState {
    fn may_go(&self, thread: usize) -> bool {
        let next = self.order.as_ref().and_then(|order| order.get(self.done));
        self.allowed == ALL || (self.done < self.allowed && next == Some(&thread))
    }
}

impl Hold {
    /// Allows the first `operations`.
    pub(crate) fn allow(&self, operations: usize) {
        let mut state = lock(&self.state);
        // What is no longer held goes on to the end.
        state.allowed = state.allowed.max(operations);
        self.changed.notify_all();
    }

    /// Lets all of it go on.
    pub(crate) fn let_go(&self) {
        self.allow(ALL);
    }

    /// Whether it holds an overlap now.
    pub(crate) fn is_on(&self) -> bool {
        let state = lock(&self.state);
        state.order.is_some() && state.allowed != ALL
    }

    /// Begins with an overlap of so many `threads`, whose operations are done by the threads in
    /// `order`.
    pub(crate) fn begin(&self, order: Vec<usize>, threads: usize) {
        let mut state = lock(&self.state);
        (state.order, state.running) = (Some(order), threads);
    }

    /// Waits until `thread` may do its next operation.
    pub(crate) fn pass(&self, thread: usize) {
        let mut state = lock(&self.state);
        if state.order.is_none() {
            return;
        }
        state.running -= 1;
        while !state.may_go(thread) {
            state = self.wait(state);
        }
        state.running += 1;
        state.done += 1;
        // The next one may be allowed, too.
        self.changed.notify_all();
    }

    /// A thread is at the end of the overlap.
    pub(crate) fn leave(&self) {
        let mut state = lock(&self.state);
        state.running = state.running.saturating_sub(1);
    }

    /// The number of operations done, once all threads are at rest.
    pub(crate) fn done(&self) -> Option<usize> {
        let state = lock(&self.state);
        let all = state.order.as_ref()?.len();
        let rests = state.running == 0 && state.done >= state.allowed.min(all);
        rests.then_some(state.done)
    }

    /// Nobody looks at it any more.
    pub(crate) fn end(&self) {
        let mut state = lock(&self.state);
        (state.ended, state.allowed) = (true, ALL);
        self.changed.notify_all();
    }

    /// Waits for that.
    pub(crate) fn wait_for_end(&self) {
        let mut state = lock(&self.state);
        while !state.ended {
            state = self.wait(state);
        }
    }

    fn wait<'a>(&self, state: MutexGuard<'a, HoldState>) -> MutexGuard<'a, HoldState> {
        let woken = self.changed.wait(state);
        woken.unwrap_or_else(PoisonError::into_inner)
    }
}
