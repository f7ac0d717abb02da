//! State that nodes share beside their topics: a lock that counts its turns.

use std::{
    fmt,
    ops::{Deref, DerefMut},
    sync::OnceLock,
    time::Duration,
};

use crate::{
    journal::turns::{self, LockName, Mode, Operation, TurnFollower},
    sync::{Mutex, MutexGuard, lock, thread},
};

/// Longest wait for a turn without a look at whether the run was given up.
const LOOK: Duration = Duration::from_millis(20);

/// A value behind a lock that counts its turns, for state that several nodes share beside
/// their topics: a plant, a map. Under the real clock the log of the run has the turns, so
/// the run can be executed again; a plain mutex would be in another order then.
///
/// Its name must differ from the names of all other shared values and topics of the graph.
///
/// ```
/// use std::sync::Arc;
/// use ratelab::{Clock, Graph, Hz, Inbox, Shared, Tick, Time};
/// use ratelab_real_clock::RealClock;
///
/// let tank = Arc::new(Shared::new("tank", 10.0));
/// let mut graph = Graph::new();
/// for (name, flow) in [("inlet", 1.0), ("outlet", -0.5)] {
///     let tank = tank.clone();
///     graph.node(name, Hz::new(100.0)?, 0, |_| move |_: &mut Tick| {
///         *tank.lock() += flow;
///     })?;
/// }
/// RealClock::default().run(&mut graph, &mut Inbox::default(), Time::from_secs_f64(0.05)?)?;
/// assert!(*tank.peek() > 0.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Shared<T> {
    name: Box<str>,
    /// The name in the log of turns, once it was needed.
    lock_name: OnceLock<LockName>,
    state: Mutex<SharedState<T>>,
}

struct SharedState<T> {
    /// Turns so far.
    turn: u64,
    /// Whether a thread that notes no turns was here since the last one that does.
    outside: bool,
    /// Threads that wait, each with its turn.
    waiting: Vec<(u64, thread::Thread)>,
    /// Whether the drop of the guard must wake the thread of the next turn. Kept here, so that the
    /// guard fits in registers.
    hands_on: bool,
    value: T,
}

impl<T> Shared<T> {
    /// Puts `value` behind a lock called `name`.
    pub fn new(name: impl Into<Box<str>>, value: T) -> Self {
        Self {
            name: name.into(),
            lock_name: OnceLock::new(),
            state: Mutex::new(SharedState {
                turn: 0,
                outside: false,
                waiting: Vec::new(),
                hands_on: false,
                value,
            }),
        }
    }

    /// Puts `value` behind a lock that has had so many `turns`.
    pub(crate) fn after(turns: u64, name: impl Into<Box<str>>, value: T) -> Self {
        let shared = Self::new(name, value);
        lock(&shared.state).turn = turns;
        shared
    }

    /// Returns the number of turns so far.
    pub(crate) fn turns(&self) -> u64 {
        lock(&self.state).turn
    }

    /// Returns the name of the lock.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Locks the value for a node, until the guard is dropped. This takes a turn: a run
    /// that is executed again has all turns in the same order.
    #[inline]
    pub fn lock(&self) -> SharedGuard<'_, T> {
        let mode = turns::mode();
        if mode == Mode::Following {
            return self.in_turn();
        }
        let mut turn = self.peek();
        match mode {
            Mode::Noting => self.note(&mut turn.state),
            _ => turn.state.outside = true,
        }
        turn
    }

    /// Locks the value without a turn, at any time: for observers and taps, and for what follows
    /// from the turns of others.
    #[inline]
    pub fn peek(&self) -> SharedGuard<'_, T> {
        SharedGuard {
            state: lock(&self.state),
        }
    }

    /// Notes the turn of the calling thread. On its own, so that a lock without notes is short.
    #[inline(never)]
    fn note(&self, state: &mut SharedState<T>) {
        turns::note(Operation {
            lock: self.lock_name(),
            turn: state.turn,
            outside: std::mem::take(&mut state.outside),
        });
        state.turn += 1;
    }

    #[inline]
    fn lock_name(&self) -> LockName {
        *self.lock_name.get_or_init(|| LockName::new(&self.name))
    }

    /// Locks the value as [`Self::peek`] does. A thread that the re-execution holds within this
    /// lock is let go.
    fn past_held(&self, follower: &dyn TurnFollower) -> SharedGuard<'_, T> {
        match self.state.try_lock() {
            Ok(state) => SharedGuard { state },
            Err(_) => {
                follower.is_blocked();
                self.peek()
            }
        }
    }

    /// Waits for the turn that this thread had in the recorded run.
    #[cold]
    fn in_turn(&self) -> SharedGuard<'_, T> {
        let follower = turns::follower();
        let next = follower.as_ref().and_then(|f| f.next(self.lock_name()));
        let Some((number, follower)) = next.zip(follower.as_deref()) else {
            return self.peek();
        };
        let mut turn = self.past_held(follower);
        while turn.state.turn != number && !follower.is_free() {
            if turn.state.turn > number {
                follower.missed(self.lock_name(), number);
                break;
            }
            turn.state.waiting.push((number, thread::current()));
            drop(turn);
            follower.waits(true);
            thread::park_timeout(LOOK);
            follower.waits(false);
            turn = self.past_held(follower);
            turn.state.waiting.retain(|(waits, _)| *waits != number);
        }
        turn.state.turn = number + 1;
        turn.state.hands_on = true;
        turn
    }
}

impl<T> fmt::Debug for Shared<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Shared({})", self.name)
    }
}

/// A shared value, locked until this is dropped.
pub struct SharedGuard<'a, T> {
    state: MutexGuard<'a, SharedState<T>>,
}

impl<T> Deref for SharedGuard<'_, T> {
    type Target = T;

    #[inline]
    fn deref(&self) -> &T {
        &self.state.value
    }
}

impl<T> DerefMut for SharedGuard<'_, T> {
    #[inline]
    fn deref_mut(&mut self) -> &mut T {
        &mut self.state.value
    }
}

impl<T> SharedState<T> {
    /// Wakes the thread of the next turn, if it waits.
    #[cold]
    fn hand_on(&mut self) {
        self.hands_on = false;
        let mut waiting = self.waiting.iter();
        if let Some((_, thread)) = waiting.find(|(turn, _)| *turn == self.turn) {
            thread.unpark();
        }
    }
}

impl<T> Drop for SharedGuard<'_, T> {
    #[inline]
    fn drop(&mut self) {
        if self.state.hands_on {
            self.state.hand_on();
        }
    }
}

impl<T: fmt::Debug> fmt::Debug for SharedGuard<'_, T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(&**self, f)
    }
}
