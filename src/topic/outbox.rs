//! Messages of a tick, held back until the tick is over.

use std::fmt;

use crate::{
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, Ordering},
        lock,
    },
    time::Time,
};

/// What a node's own clock shows at a run time.
pub type Stamps = Arc<dyn Fn(Time) -> Time + Send + Sync>;

/// Publishes one message; takes the run time and the stamp.
type Held = Box<dyn FnOnce(Time, Time) + Send>;

/// Holds the messages of a node during a tick with a duration, or stamps
/// them while the node's clock has an error.
#[derive(Default)]
pub(crate) struct Outbox {
    /// Whether messages must pass through this outbox.
    needed: AtomicBool,
    state: Mutex<OutboxState>,
}

#[derive(Default)]
struct OutboxState {
    /// Whether the node does the work of a tick with a duration.
    holds: bool,
    held: Vec<Held>,
    stamps: Option<Stamps>,
}

impl OutboxState {
    fn shows(&self, now: Time) -> Time {
        self.stamps.as_ref().map_or(now, |stamps| stamps(now))
    }
}

impl Outbox {
    /// Whether messages must pass through this outbox.
    pub(crate) fn is_needed(&self) -> bool {
        self.needed.load(Ordering::Relaxed)
    }

    /// Starts or stops holding messages back.
    pub(crate) fn hold(&self, on: bool) {
        self.update(|state| state.holds = on);
    }

    /// Stamps messages with what `stamps` returns from now on.
    pub(crate) fn set_stamps(&self, stamps: Stamps) {
        self.update(|state| state.stamps = Some(stamps));
    }

    fn update(&self, change: impl FnOnce(&mut OutboxState)) {
        let mut state = lock(&self.state);
        change(&mut state);
        let needed = state.holds || state.stamps.is_some();
        self.needed.store(needed, Ordering::Relaxed);
    }

    /// The reading of the node's clock at run time `now`.
    pub(crate) fn shows(&self, now: Time) -> Time {
        lock(&self.state).shows(now)
    }

    /// Publishes a message at run time `now`, or keeps it until the tick is over.
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

    /// Publishes all held messages at run time `now`, in order.
    pub(crate) fn publish_held(&self, now: Time) {
        let mut state = lock(&self.state);
        let (held, stamp) = (std::mem::take(&mut state.held), state.shows(now));
        drop(state);
        held.into_iter().for_each(|message| message(now, stamp));
    }

    /// Discards all held messages.
    pub(crate) fn clear(&self) {
        lock(&self.state).held.clear();
    }
}

impl fmt::Debug for Outbox {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Outbox").finish_non_exhaustive()
    }
}
