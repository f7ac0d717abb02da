//! What a thread does with the turns of shared state: nothing, note them, or keep to the
//! noted ones.

use std::cell::{Cell, RefCell};

use super::{lock_name::LockName, watch::Watch};
use crate::sync::{Arc, thread_local};

/// One access to shared state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Operation {
    pub(crate) lock: LockName,
    /// Number of turns before this one.
    pub(crate) turn: u64,
    /// Whether a thread that notes no turns had been there since the turn before.
    pub(crate) outside: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    Off,
    Noting,
    Following,
}

thread_local! {
    static MODE: Cell<Mode> = const { Cell::new(Mode::Off) };
    static NOTED: RefCell<Vec<Operation>> = const { RefCell::new(Vec::new()) };
    static SCRIPT: RefCell<Option<Script>> = const { RefCell::new(None) };
}

#[inline]
pub(super) fn mode() -> Mode {
    MODE.with(Cell::get)
}

/// Notes an operation of this thread.
#[inline]
pub(super) fn note(operation: Operation) {
    NOTED.with(|noted| noted.borrow_mut().push(operation));
}

/// While this lives, its thread notes its turns.
#[derive(Debug)]
pub(crate) struct Noter {
    before: Mode,
    noted: Vec<Operation>,
}

impl Noter {
    pub(crate) fn new() -> Self {
        Self {
            before: MODE.with(|mode| mode.replace(Mode::Noting)),
            noted: NOTED.with(RefCell::take),
        }
    }

    /// Hands the operations since the last call to `take`.
    pub(crate) fn take(take: impl FnOnce(&[Operation])) {
        NOTED.with(|noted| {
            let mut noted = noted.borrow_mut();
            take(&noted);
            noted.clear();
        });
    }
}

impl Drop for Noter {
    fn drop(&mut self) {
        MODE.with(|mode| mode.set(self.before));
        NOTED.with(|noted| noted.replace(std::mem::take(&mut self.noted)));
    }
}

/// The operations that a thread is to do in its entry.
struct Script {
    watch: Arc<Watch>,
    /// Index of the thread.
    thread: usize,
    expected: Vec<Operation>,
    done: usize,
}

/// While this lives, its thread keeps to the turns that it is given.
#[derive(Debug)]
pub(crate) struct TurnFollower {
    before: Mode,
}

impl TurnFollower {
    pub(crate) fn new(watch: Arc<Watch>) -> Self {
        let script = Script {
            watch,
            thread: 0,
            expected: Vec::new(),
            done: 0,
        };
        SCRIPT.with(|this| this.replace(Some(script)));
        Self {
            before: MODE.with(|mode| mode.replace(Mode::Following)),
        }
    }
}

impl Drop for TurnFollower {
    fn drop(&mut self) {
        MODE.with(|mode| mode.set(self.before));
        SCRIPT.with(|this| this.take());
    }
}

/// Sets the operations of the next entry of this thread, which is number `thread`.
pub(crate) fn expect(thread: usize, operations: &[Operation]) {
    with_script(|script| {
        script.thread = thread;
        script.expected.clear();
        script.expected.extend_from_slice(operations);
        script.done = 0;
    });
}

/// Checks that the entry has done all its operations.
pub(crate) fn finish_entry() {
    with_script(|script| {
        if let Some(next) = script.expected.get(script.done) {
            script.watch.differs(format!(
                "{} ended its tick where the recorded run took {}",
                script.watch.name(script.thread),
                next.lock.text()
            ));
        }
    });
}

/// The turn for the next operation of this thread, on `lock`; `None` if it is free to do
/// anything, because this run is not the recorded one.
pub(super) fn next(lock: LockName) -> Option<u64> {
    with_script(|script| {
        if script.watch.is_over() {
            return None;
        }
        let expected = script.expected.get(script.done);
        match expected {
            Some(operation) if operation.lock == lock => {
                script.done += 1;
                let turn = operation.turn;
                script.watch.perturb();
                script.watch.hold().pass(script.thread);
                Some(turn)
            }
            other => {
                let other = other.map(|operation| operation.lock.text());
                script.watch.differs(format!(
                    "{} took {} where the recorded run took {}",
                    script.watch.name(script.thread),
                    lock.text(),
                    other.as_deref().unwrap_or("nothing more")
                ));
                None
            }
        }
    })
    .flatten()
}

/// The watch over this thread, and its index.
pub(super) fn watch() -> Option<(Arc<Watch>, usize)> {
    with_script(|script| (script.watch.clone(), script.thread))
}

fn with_script<R>(then: impl FnOnce(&mut Script) -> R) -> Option<R> {
    SCRIPT.with(|script| script.borrow_mut().as_mut().map(then))
}
