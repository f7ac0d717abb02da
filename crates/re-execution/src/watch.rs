//! Watches a run that is executed again, holds it, and has its threads keep to their turns.

use std::{
    cell::Cell,
    collections::{BTreeMap, BTreeSet},
    hash::{BuildHasher, RandomState},
    sync::PoisonError,
    time::Duration,
};

use ratelab::{
    Time,
    journal::{LockName, Operation, TurnFollower},
    sync::{Arc, Condvar, Mutex, MutexGuard, lock, thread},
};

/// Longest pause of a thread before an operation that is to be perturbed.
const LONGEST_PAUSE_US: u64 = 100;

/// The number of operations of an overlap that is not held.
const ALL: usize = usize::MAX;

/// A run that is executed again, as seen from other threads: its first difference from the
/// recorded one, and what it is doing.
#[derive(Debug)]
pub struct Watch {
    /// The names of the threads.
    names: Vec<Arc<str>>,
    state: Mutex<WatchState>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct WatchState {
    difference: Option<String>,
    /// Whether it is not the recorded run, or nobody looks at it any more.
    over: bool,
    perturbed: bool,
    /// Entries that are finished.
    finished: u64,
    /// Run time at which each thread began the entry that it is in, and how long that took when it
    /// was recorded.
    busy: BTreeMap<usize, (Time, Duration)>,
    /// Threads that wait for their turn.
    waiting: BTreeSet<usize>,
    hold: Hold,
}

/// An overlap whose operations are done one by one, in the order of the plan.
#[derive(Debug, Default)]
struct Hold {
    /// The threads of the operations, in order; `None` until the run is there.
    order: Option<Vec<usize>>,
    /// Operations that may be done.
    allowed: usize,
    /// Operations that were begun.
    done: usize,
    /// Threads that are neither held nor at the end of the overlap.
    running: usize,
}

impl Hold {
    fn may_go(&self, thread: usize) -> bool {
        let next = self.order.as_ref().and_then(|order| order.get(self.done));
        self.allowed == ALL || (self.done < self.allowed && next == Some(&thread))
    }
}

/// What a run does at a moment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Doing {
    /// Number of ticks and commands that are over.
    pub finished: u64,
    /// The node that all others wait for, if one is in a tick.
    pub node: Option<BusyNode>,
}

/// A node in a tick.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BusyNode {
    /// Its name.
    pub name: Arc<str>,
    /// Run time at which the tick began.
    pub at: Time,
    /// How long the tick took in the recorded run.
    pub took: Duration,
}

/// For observers.
impl Watch {
    /// Returns the first operation that was not the recorded one; `None` if there is none.
    pub fn difference(&self) -> Option<String> {
        self.state().difference.clone()
    }

    /// Returns what the run does now.
    pub fn doing(&self) -> Doing {
        let state = self.state();
        // The supervisor is not a node.
        let node = state
            .busy
            .range(1..)
            .find(|(thread, _)| !state.waiting.contains(thread));
        Doing {
            finished: state.finished,
            node: node.map(|(thread, (at, took))| BusyNode {
                name: self.name(*thread).into(),
                at: *at,
                took: *took,
            }),
        }
    }

    /// Allows the first `operations` of the overlap in which the run is [held](crate::ReExecution::hold).
    pub fn allow(&self, operations: usize) {
        let mut state = self.state();
        // What is no longer held goes on to the end.
        state.hold.allowed = state.hold.allowed.max(operations);
        self.changed.notify_all();
    }

    /// Returns the number of operations of that overlap that are done, once its nodes are at rest.
    pub fn held(&self) -> Option<usize> {
        let hold = &self.state().hold;
        let all = hold.order.as_ref()?.len();
        let rests = hold.running == 0 && hold.done >= hold.allowed.min(all);
        rests.then_some(hold.done)
    }

    /// Ends a run that is held.
    pub fn end(&self) {
        self.state().over = true;
        self.allow(ALL);
    }
}

/// For the run.
impl Watch {
    /// Watches the threads with these `names`.
    pub(crate) fn new(names: Vec<Arc<str>>) -> Self {
        Self {
            names,
            state: Mutex::default(),
            changed: Condvar::default(),
        }
    }

    fn state(&self) -> MutexGuard<'_, WatchState> {
        lock(&self.state)
    }

    /// Returns the name of a thread.
    pub(crate) fn name(&self, thread: usize) -> &str {
        self.names.get(thread).map_or("nobody", |name| name)
    }

    /// Lets every thread pause for a random time before each operation.
    pub(crate) fn perturb(&self) {
        self.state().perturbed = true;
    }

    pub(crate) fn is_perturbed(&self) -> bool {
        self.state().perturbed
    }

    /// Gives up: this is not the recorded run. The first reason counts.
    pub(crate) fn differs(&self, reason: String) {
        let mut state = self.state();
        if !std::mem::replace(&mut state.over, true) {
            state.difference = Some(reason);
        }
        drop(state);
        self.allow(ALL);
    }

    /// Returns whether the run was given up.
    pub(crate) fn is_over(&self) -> bool {
        self.state().over
    }

    /// Notes that a thread begins an entry at run time `at`, which `took` so long in the
    /// recorded run; `false` if the run was given up.
    pub(crate) fn begins(&self, thread: usize, at: Time, took: Duration) -> bool {
        let mut state = self.state();
        state.busy.insert(thread, (at, took));
        !state.over
    }

    /// Notes that a thread finished its entry.
    pub(crate) fn finishes(&self, thread: usize) {
        let mut state = self.state();
        state.finished += 1;
        state.busy.remove(&thread);
    }

    /// Notes whether a thread waits for its turn.
    pub(crate) fn waits(&self, thread: usize, waits: bool) {
        let waiting = &mut self.state().waiting;
        if waits {
            waiting.insert(thread)
        } else {
            waiting.remove(&thread)
        };
    }

    /// Waits until `thread` may do its next operation; `false` if the run was given up.
    pub(crate) fn pass(&self, thread: usize) -> bool {
        let mut state = self.state();
        if state.over {
            return false;
        }
        if state.perturbed {
            drop(state);
            let random = RandomState::new().hash_one(0) % LONGEST_PAUSE_US;
            thread::sleep(Duration::from_micros(random));
            state = self.state();
        }
        if state.hold.order.is_some() {
            state.hold.running -= 1;
            while !state.hold.may_go(thread) {
                state = self.wait(state);
            }
            state.hold.running += 1;
            state.hold.done += 1;
            // The next one may be allowed, too.
            self.changed.notify_all();
        }
        !state.over
    }

    /// Holds an overlap of so many `threads`, whose operations are done by the threads in `order`.
    pub(crate) fn hold(&self, order: Vec<usize>, threads: usize) {
        let hold = &mut self.state().hold;
        (hold.order, hold.running) = (Some(order), threads);
    }

    /// Lets all of the overlap go on, if the run is in it.
    pub(crate) fn let_go_if_held(&self) {
        let is_held = self.state().hold.order.is_some();
        if is_held {
            self.allow(ALL);
        }
    }

    /// A thread is at the end of the overlap.
    pub(crate) fn leave(&self) {
        let hold = &mut self.state().hold;
        hold.running = hold.running.saturating_sub(1);
    }

    /// Waits until nobody looks at the overlap any more.
    pub(crate) fn wait_for_end(&self) {
        let mut state = self.state();
        while !state.over {
            state = self.wait(state);
        }
    }

    fn wait<'s>(&self, state: MutexGuard<'s, WatchState>) -> MutexGuard<'s, WatchState> {
        let woken = self.changed.wait(state);
        woken.unwrap_or_else(PoisonError::into_inner)
    }
}

/// The operations that a thread is to do in an entry.
pub(crate) struct Script {
    pub(crate) watch: Arc<Watch>,
    /// Number of the thread.
    pub(crate) thread: usize,
    pub(crate) operations: Arc<[Operation]>,
    /// Number of operations done.
    pub(crate) done: Cell<usize>,
}

impl Script {
    fn expected(&self) -> Option<&Operation> {
        self.operations.get(self.done.get())
    }

    /// Checks that the entry has done all its operations.
    pub(crate) fn finish(&self) {
        if let Some(next) = self.expected() {
            let (name, lock) = (self.watch.name(self.thread), next.lock.text());
            let why = format!("{name} ended its tick where the recorded run took {lock}");
            self.watch.differs(why);
        }
    }
}

impl TurnFollower for Script {
    fn next(&self, lock: LockName) -> Option<u64> {
        let expected = self.expected();
        if let Some(operation) = expected.filter(|operation| operation.lock == lock) {
            self.done.set(self.done.get() + 1);
            return self.watch.pass(self.thread).then_some(operation.turn);
        }
        self.watch.differs(format!(
            "{} took {} where the recorded run took {}",
            self.watch.name(self.thread),
            lock.text(),
            expected
                .map(|operation| operation.lock.text())
                .as_deref()
                .unwrap_or("nothing more")
        ));
        None
    }

    fn missed(&self, lock: LockName, turn: u64) {
        let name = lock.text();
        let why = format!("turn {turn} of {name} was taken by another");
        self.watch.differs(why);
    }

    fn is_free(&self) -> bool {
        self.watch.is_over()
    }

    fn waits(&self, waits: bool) {
        self.watch.waits(self.thread, waits);
    }

    fn is_blocked(&self) {
        self.watch.let_go_if_held();
    }
}
