//! A copy of every message of a topic, for those who want all and not the latest.

use crossbeam_channel::{Receiver, Sender, TrySendError};

use super::{
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    topic::{Message, Payload, bump},
};

/// What a full tap does: lose the message and count it, or make the publisher
/// wait.
///
/// Wall time may not wait for an observer, virtual time may: whoever runs the
/// graph turns patience on and off for all its taps.
#[derive(Clone, Debug, Default)]
pub struct Patience(Arc<AtomicBool>);

impl Patience {
    pub(crate) fn set(&self, patient: bool) {
        self.0.store(patient, Ordering::Relaxed);
    }

    fn get(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

#[derive(Debug)]
pub(crate) struct TapEnd<T> {
    sender: Sender<Message<T>>,
    lost: Arc<AtomicU64>,
    patience: Patience,
}

/// A tap for `capacity` messages, and the end that a topic fills.
pub(crate) fn tap<T>(capacity: usize, patience: Patience) -> (TapEnd<T>, Tap<T>) {
    let (sender, messages) = crossbeam_channel::bounded(capacity.max(1));
    let lost = Arc::new(AtomicU64::new(0));
    let end = TapEnd {
        sender,
        lost: lost.clone(),
        patience,
    };
    (end, Tap { messages, lost })
}

impl<T: Payload> TapEnd<T> {
    /// Hands over a copy; false once nobody listens any more.
    pub(crate) fn offer(&self, message: &Message<T>) -> bool {
        if self.patience.get() {
            return self.sender.send(message.clone()).is_ok();
        }
        match self.sender.try_send(message.clone()) {
            Ok(()) => true,
            Err(TrySendError::Disconnected(_)) => false,
            Err(TrySendError::Full(_)) => {
                bump(&self.lost);
                true
            }
        }
    }
}

/// Receives every message of a topic in order; see
/// [`Topic::tap`](super::Topic::tap). Ends when
/// the last handle of the topic is gone.
#[derive(Debug)]
pub struct Tap<T> {
    messages: Receiver<Message<T>>,
    lost: Arc<AtomicU64>,
}

impl<T> Tap<T> {
    /// The messages; the receiver is disconnected when the topic is gone.
    pub fn messages(&self) -> &Receiver<Message<T>> {
        &self.messages
    }

    /// Messages that found the tap full.
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }
}
