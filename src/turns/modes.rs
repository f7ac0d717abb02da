//! What a thread does with the turns of shared state: nothing, note them, or keep to given
//! ones.

use std::{
    cell::{Cell, RefCell},
    rc::Rc,
};

use super::lock_name::LockName;
use crate::sync::thread_local;

/// One access to shared state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Operation {
    /// What was taken.
    pub lock: LockName,
    /// Number of turns before this one.
    pub turn: u64,
    /// Whether a thread that notes no turns had been there since the turn before.
    pub outside: bool,
}

/// Knows the turns that a thread is to have.
pub trait TurnFollower {
    /// The turn for the next operation of the thread, on `lock`; `None` if it is free to do
    /// anything, because this run is not the recorded one.
    fn next(&self, lock: LockName) -> Option<u64>;

    /// The turn of `lock` that the thread was to have was taken by another.
    fn missed(&self, lock: LockName, turn: u64);

    /// Whether the thread is free to do anything.
    fn is_free(&self) -> bool;

    /// The thread waits for its turn, or waits no more.
    fn waits(&self, waits: bool);

    /// Whether another thread may be held within a lock, until it is let go.
    fn holds(&self) -> bool;

    /// Lets all threads go.
    fn let_go(&self);
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
    static FOLLOWER: RefCell<Option<Rc<dyn TurnFollower>>> = const { RefCell::new(None) };
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

/// While this lives, its thread keeps to the turns that a [`TurnFollower`] knows.
#[derive(Debug)]
pub struct Following {
    before: Mode,
}

impl Following {
    /// Has the calling thread keep to the turns of `follower`.
    pub fn new(follower: Rc<dyn TurnFollower>) -> Self {
        FOLLOWER.with(|this| this.replace(Some(follower)));
        Self {
            before: MODE.with(|mode| mode.replace(Mode::Following)),
        }
    }
}

impl Drop for Following {
    fn drop(&mut self) {
        MODE.with(|mode| mode.set(self.before));
        FOLLOWER.with(|this| this.take());
    }
}

pub(super) fn follower() -> Option<Rc<dyn TurnFollower>> {
    FOLLOWER.with(|follower| follower.borrow().clone())
}
