//! Copies of all messages and ticks, for readers that need more than the newest one.

use std::mem;

use crossbeam_channel::{Receiver, Sender, TrySendError};

use ratelab::{
    Head, Message, RunState,
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, AtomicU64, Ordering},
        lock,
    },
};

/// A message as a tap sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TapMessage<T> {
    /// The message.
    pub message: Message<T>,
    /// The message without its payload, and when subscriptions can read it.
    pub head: Head,
}

/// Receives all items, in order; see [`TapHandle`](super::TapHandle). Ends when the tapped topic
/// or node is gone. A full tap loses items and counts them under the real clock; in virtual time
/// the run waits for it, which costs no run time. So read a tap of a virtual run on another thread,
/// or give it room for the whole run: on one thread a full tap stops the run for good.
///
/// ```
/// use ratelab::{Depth, Graph, Hz, Tick, Time, Topic};
/// use ratelab_metrics::TapHandle;
///
/// let (topic, mut graph) = (Topic::new("/range", Depth::ONE), Graph::new());
/// graph.node("sonar", Hz::new(10.0)?, 0, |wiring| {
///     let _range = wiring.publisher(&topic);
///     |_: &mut Tick| {}
/// })?;
/// let tap = TapHandle::new(&graph).topic(&topic, 100);
/// let publisher = topic.publisher();
/// (1..=3).for_each(|n| Tick::at(Time::from_nanos(n)).publish(&publisher, n));
/// let all = tap.items().try_iter().map(|tapped| tapped.message.data);
/// assert_eq!(all.collect::<Vec<_>>(), [1, 2, 3]); // Not the latest only.
/// assert_eq!(tap.lost(), 0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Tap<T> {
    items: Receiver<T>,
    lost: Arc<AtomicU64>,
}

impl<T> Tap<T> {
    /// Returns the receiver of the items; disconnected when the tap has ended.
    pub fn items(&self) -> &Receiver<T> {
        &self.items
    }

    /// Returns the number of items lost because the tap was full.
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }
}

/// The sending end of a tap.
#[derive(Clone, Debug)]
pub(crate) struct TapSender<T> {
    sender: Sender<T>,
    lost: Arc<AtomicU64>,
    /// The run that may wait for a full tap, instead of losing items; `None` if none may.
    run: Option<Arc<RunState>>,
}

/// Creates a tap for `capacity` items, with its sending end.
pub(crate) fn tap<T>(capacity: usize, run: Option<Arc<RunState>>) -> (TapSender<T>, Tap<T>) {
    let (sender, items) = crossbeam_channel::bounded(capacity.max(1));
    let lost = Arc::new(AtomicU64::new(0));
    let end = TapSender {
        sender,
        lost: lost.clone(),
        run,
    };
    (end, Tap { items, lost })
}

impl<T> TapSender<T> {
    /// Sends `item`; returns `false` once the receiver is gone.
    pub(crate) fn offer(&self, item: T) -> bool {
        if self.run.as_ref().is_some_and(|run| run.waits()) {
            return self.sender.send(item).is_ok();
        }
        match self.sender.try_send(item) {
            Ok(()) => true,
            Err(TrySendError::Disconnected(_)) => false,
            Err(TrySendError::Full(_)) => {
                self.lose(1);
                true
            }
        }
    }

    fn lose(&self, items: u64) {
        self.lost.fetch_add(items, Ordering::Relaxed);
    }
}

/// Gathers items and sends them together: a send costs as much as twenty copies.
#[derive(Debug)]
pub(crate) struct LotSender<T> {
    lot: Mutex<Vec<T>>,
    end: TapSender<Vec<T>>,
}

impl<T> LotSender<T> {
    /// Number of items in a lot.
    const ITEMS: usize = 512;

    /// Sends lots to `end`.
    pub(crate) fn new(end: TapSender<Vec<T>>) -> Self {
        let lot = Mutex::new(Vec::with_capacity(Self::ITEMS));
        Self { lot, end }
    }

    /// Adds `item`, and sends a full lot; returns `false` once the receiver is gone.
    pub(crate) fn offer(&self, item: T) -> bool {
        let mut lot = lock(&self.lot);
        lot.push(item);
        // Lots keep their order: the lock is held until the lot is on its way.
        lot.len() < Self::ITEMS || {
            let full = mem::replace(&mut *lot, Vec::with_capacity(Self::ITEMS));
            self.end.offer(full)
        }
    }
}

impl<T> Drop for LotSender<T> {
    /// Sends the rest.
    fn drop(&mut self) {
        let rest = mem::take(&mut *lock(&self.lot));
        if !rest.is_empty() {
            self.end.offer(rest);
        }
    }
}

/// The listeners to a series of items. Without any, an item costs one load only.
#[derive(Debug)]
pub(crate) struct Listeners<L> {
    any: AtomicBool,
    all: Mutex<Vec<L>>,
}

impl<L> Default for Listeners<L> {
    fn default() -> Self {
        Self {
            any: AtomicBool::new(false),
            all: Mutex::new(Vec::new()),
        }
    }
}

impl<L> Listeners<L> {
    /// Adds one, for all items from now on.
    pub(crate) fn add(&self, listener: L) {
        lock(&self.all).push(listener);
        self.any.store(true, Ordering::Release);
    }

    /// Returns whether there are any.
    #[inline]
    pub(crate) fn are_any(&self) -> bool {
        self.any.load(Ordering::Acquire)
    }

    /// Hands each of them an item; removes a listener if `hand` returns `false`.
    #[inline]
    pub(crate) fn each(&self, hand: impl FnMut(&mut L) -> bool) {
        if self.are_any() {
            let mut all = lock(&self.all);
            all.retain_mut(hand);
            self.any.store(!all.is_empty(), Ordering::Release);
        }
    }
}

/// Copies of a series of items for any number of taps: whatever is received of a run elsewhere.
#[derive(Debug)]
pub struct Copies<T>(Listeners<TapSender<T>>);

impl<T> Default for Copies<T> {
    fn default() -> Self {
        Self(Listeners::default())
    }
}

impl<T: Clone> Copies<T> {
    /// Returns a tap for all items from now on. A full one, of `capacity` items, loses and counts.
    pub fn tap(&self, capacity: usize) -> Tap<T> {
        let (end, tap) = tap(capacity, None);
        self.0.add(end);
        tap
    }

    /// Sends every tap a copy.
    pub fn offer(&self, item: &T) {
        self.0.each(|end| end.offer(item.clone()));
    }

    /// Counts `items` as lost by every tap: they never came here.
    pub fn lose(&self, items: u64) {
        self.0.each(|end| {
            end.lose(items);
            true
        });
    }
}
