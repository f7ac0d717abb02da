//! What a tick publishes, held back until the tick is over.

use std::fmt;

use super::{
    local_clock::LocalClock,
    sync::{
        Mutex,
        atomic::{AtomicBool, Ordering},
        lock,
    },
    time::Time,
};

/// Publishes one message at the given run time, with the given stamp.
type Held = Box<dyn FnOnce(Time, Time) + Send>;

/// Where all publishers of a node put their messages while the node is in a tick
/// that takes time, or while its clock is wrong.
#[derive(Default)]
pub(crate) struct Outbox {
    /// Whether messages are to be put in here.
    needed: AtomicBool,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    /// Whether the node is in a tick that takes time.
    holds: bool,
    held: Vec<Held>,
    clock: Option<LocalClock>,
}

impl State {
    fn shows(&self, now: Time) -> Time {
        self.clock.map_or(now, |clock| clock.shows(now))
    }
}

impl Outbox {
    /// Whether messages are to be put in here.
    pub(crate) fn is_needed(&self) -> bool {
        self.needed.load(Ordering::Relaxed)
    }

    /// Begins or ceases to hold messages back.
    pub(crate) fn hold(&self, on: bool) {
        self.update(|state| state.holds = on);
    }

    /// Stamps messages by `clock` from now on.
    pub(crate) fn set_clock(&self, clock: LocalClock) {
        self.update(|state| state.clock = Some(clock));
    }

    fn update(&self, change: impl FnOnce(&mut State)) {
        let mut state = lock(&self.state);
        change(&mut state);
        let needed = state.holds || state.clock.is_some();
        self.needed.store(needed, Ordering::Relaxed);
    }

    /// What the node's clock shows at run time `now`.
    pub(crate) fn shows(&self, now: Time) -> Time {
        lock(&self.state).shows(now)
    }

    /// Publishes a message at run time `now`, or when the tick is over.
    pub(crate) fn put(&self, now: Time, message: Held) {
        let mut state = lock(&self.state);
        if state.holds {
            state.held.push(message);
            return;
        }
        let stamp = state.shows(now);
        drop(state);
        message(now, stamp);
    }

    /// Publishes all that is held back at run time `now`, in order.
    pub(crate) fn release(&self, now: Time) {
        let mut state = lock(&self.state);
        let (held, stamp) = (std::mem::take(&mut state.held), state.shows(now));
        drop(state);
        held.into_iter().for_each(|message| message(now, stamp));
    }

    /// Forgets all that is held back.
    pub(crate) fn clear(&self) {
        lock(&self.state).held.clear();
    }
}

impl fmt::Debug for Outbox {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Outbox").finish_non_exhaustive()
    }
}
