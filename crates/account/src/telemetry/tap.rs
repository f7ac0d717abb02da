//! Copies of all messages, for readers that need more than the newest one.

use std::time::Duration;

use crossbeam_channel::{Receiver, Sender, TrySendError};

use ratelab::{
    Head, Message, Push, RunState, Time,
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, AtomicU64, Ordering},
        bump, lock,
    },
};

/// A message as a tap sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TapMessage<T> {
    /// The message.
    pub message: Message<T>,
    /// Run time at which it was published: its stamp, unless a clock is wrong.
    pub at: Time,
    /// Run time at which subscriptions can read it; `None` if it is lost. A message that
    /// arrives after a newer one is never read.
    pub arrives: Option<Time>,
    /// Messages of its topic lost unread so far, over all subscriptions, including any
    /// that this message evicted.
    pub dropped: u64,
}

impl<T> TapMessage<T> {
    /// The message with this `head`.
    pub(super) fn new(head: &Head, data: T) -> Self {
        let Head {
            stamp, seq, origin, ..
        } = *head;
        Self {
            message: Message {
                data,
                stamp,
                seq,
                origin,
            },
            at: head.at,
            arrives: head.arrives,
            dropped: head.dropped,
        }
    }

    /// The message without its payload.
    pub fn head(&self) -> Head {
        let Message {
            stamp, seq, origin, ..
        } = self.message;
        Head {
            at: self.at,
            stamp,
            seq,
            origin,
            arrives: self.arrives,
            dropped: self.dropped,
        }
    }
}

/// A finished tick of a node as a tap sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TickRecord {
    /// Number of the tick, counted from zero.
    pub number: u64,
    /// Run time of its start.
    pub at: Time,
    /// Run time at which it published and acted; `None` if the run ended before.
    pub ends: Option<Time>,
    /// Lateness of its start; `None` under the virtual clock unless a lateness is set.
    pub lateness: Option<Duration>,
    /// Duration; `None` where it was not measured.
    pub took: Option<Duration>,
    /// Periods that the node has skipped so far because it was busy.
    pub overruns: u64,
    /// What it did to the world; `None` if it did nothing that was sensed for.
    pub push: Option<Push>,
}

/// The sending end of a tap.
#[derive(Debug)]
pub(super) struct TapSender<T> {
    sender: Sender<T>,
    lost: Arc<AtomicU64>,
    /// The run that may wait for a full tap, instead of losing items; `None` if none may.
    run: Option<Arc<RunState>>,
}

/// Creates a tap for `capacity` items, with its sending end.
pub(super) fn tap<T>(capacity: usize, run: Option<Arc<RunState>>) -> (TapSender<T>, Tap<T>) {
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
    pub(super) fn offer(&self, item: T) -> bool {
        if self.run.as_ref().is_some_and(|run| run.waits()) {
            return self.sender.send(item).is_ok();
        }
        match self.sender.try_send(item) {
            Ok(()) => true,
            Err(TrySendError::Disconnected(_)) => false,
            Err(TrySendError::Full(_)) => {
                bump(&self.lost);
                true
            }
        }
    }

    fn lose(&self, items: u64) {
        self.lost.fetch_add(items, Ordering::Relaxed);
    }
}

/// Receives all items, in order; see [`TapHandle`](super::TapHandle). Ends when the tapped topic
/// or node is gone. A full tap loses items and counts them under the real clock; in virtual time
/// the run waits for it, which costs no run time.
///
/// ```
/// use ratelab::{Depth, GO_ON, Graph, Hz, Time, Topic};
/// use ratelab_account::TapHandle;
///
/// let (topic, mut graph) = (Topic::new("/range", Depth::ONE), Graph::new());
/// graph.node("sonar", Hz::new(10.0)?, 0, |wiring| {
///     let _range = wiring.publisher(&topic);
///     |_| GO_ON
/// })?;
/// let tap = TapHandle::of(&graph).topic(&topic, 100);
/// let publisher = topic.publisher();
/// (1..=3).for_each(|n| publisher.publish(n, Time::from_nanos(n), None));
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
    /// The receiver of the items; disconnected when the tap has ended.
    pub fn items(&self) -> &Receiver<T> {
        &self.items
    }

    /// Number of items lost because the tap was full.
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }
}

/// Copies of a series of items for any number of taps: the ticks of a node, or whatever is
/// received of a run elsewhere.
#[derive(Debug)]
pub struct Copies<T> {
    /// Whether there are any taps, so that without them an item costs one load only.
    tapped: AtomicBool,
    ends: Mutex<Vec<TapSender<T>>>,
}

impl<T> Default for Copies<T> {
    fn default() -> Self {
        Self {
            tapped: AtomicBool::new(false),
            ends: Mutex::new(Vec::new()),
        }
    }
}

impl<T: Clone> Copies<T> {
    /// A tap for all items from now on. A full one, of `capacity` items, loses and counts.
    pub fn tap(&self, capacity: usize) -> Tap<T> {
        let (end, tap) = tap(capacity, None);
        self.add(end);
        tap
    }

    /// Adds a tap for all items from now on.
    pub(super) fn add(&self, end: TapSender<T>) {
        lock(&self.ends).push(end);
        self.tapped.store(true, Ordering::Release);
    }

    /// Sends every tap a copy, and removes taps without a receiver.
    pub fn offer(&self, item: impl FnOnce() -> T) {
        if !self.tapped.load(Ordering::Acquire) {
            return;
        }
        let item = item();
        let mut ends = lock(&self.ends);
        ends.retain(|end| end.offer(item.clone()));
        self.tapped.store(!ends.is_empty(), Ordering::Release);
    }

    /// Counts `items` as lost by every tap: they never came here.
    pub fn lose(&self, items: u64) {
        let ends = lock(&self.ends);
        ends.iter().for_each(|end| end.lose(items));
    }
}
