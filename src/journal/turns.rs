//! State that nodes share, in turns: noted while a real clock runs, kept to when the run is
//! executed again.
//!
//! Nodes are functions of what they read. Two runs of the same graph on threads differ in only two
//! things: *when* each tick began, and *in which order* the threads took what they share. A
//! [`Shared`](crate::Shared) value is a lock that counts its *turns*. A thread that notes its turns
//! remembers for each of its operations which lock it took, and which turn that was: enough to
//! order all operations again (Instant Replay, LeBlanc and Mellor-Crummey 1987; DejaVu, Choi and
//! Srinivasan 1998; LEAP, Huang, Liu and Zhang 2010).

use std::{
    cell::{Cell, RefCell},
    rc::Rc,
    sync::{Arc, LazyLock, Mutex, PoisonError},
};

use crate::sync::thread_local;

/// The name of a lock: the same number for the same name, within this process.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LockName(u32);

/// All names so far. No part of a model: a thread holds it for a look only.
static NAMES: LazyLock<Mutex<Vec<Arc<str>>>> = LazyLock::new(Mutex::default);

impl LockName {
    /// Creates the number of `name`.
    pub fn new(name: &str) -> Self {
        let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
        let known = names.iter().position(|known| &**known == name);
        let index = known.unwrap_or_else(|| {
            names.push(name.into());
            names.len() - 1
        });
        Self(index as u32)
    }

    /// Returns the name.
    pub fn text(self) -> Arc<str> {
        let names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
        names.get(self.0 as usize).cloned().unwrap_or_default()
    }
}

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
    /// Returns the turn for the next operation of the thread, on `lock`; `None` if it is free to do
    /// anything, because this run is not the recorded one.
    fn next(&self, lock: LockName) -> Option<u64>;

    /// The turn of `lock` that the thread was to have was taken by another.
    fn missed(&self, lock: LockName, turn: u64);

    /// Returns whether the thread is free to do anything.
    fn is_free(&self) -> bool;

    /// The thread waits for its turn, or waits no more.
    fn waits(&self, waits: bool);

    /// Another thread is within the lock that this one is to take. If the re-execution holds the
    /// other thread there, the re-execution lets it go.
    fn is_blocked(&self);
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mode {
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
pub(crate) fn mode() -> Mode {
    MODE.with(Cell::get)
}

/// Notes an operation of this thread.
#[inline]
pub(crate) fn note(operation: Operation) {
    NOTED.with(|noted| noted.borrow_mut().push(operation));
}

/// While this lives, its thread notes its turns.
#[derive(Debug)]
pub struct Noter {
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
    /// Keeps the calling thread to the turns of `follower`.
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

pub(crate) fn follower() -> Option<Rc<dyn TurnFollower>> {
    FOLLOWER.with(|follower| follower.borrow().clone())
}
