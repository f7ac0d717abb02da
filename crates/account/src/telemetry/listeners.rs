//! Those who get the messages of a topic with their payloads.

use std::any::Any;

use ratelab::{
    Head, Payload, Time,
    sync::{
        Mutex,
        atomic::{AtomicBool, Ordering},
        lock,
    },
};

use super::tap::{TapMessage, TapSender};

/// Gets the messages of a topic.
pub(super) trait Listener: Send {
    /// Takes a message; returns `false` once nobody listens any more.
    fn hear(&mut self, head: &Head, payload: &dyn Any) -> bool;
}

impl<T: Payload> Listener for TapSender<TapMessage<T>> {
    fn hear(&mut self, head: &Head, payload: &dyn Any) -> bool {
        let data = payload.downcast_ref::<T>();
        data.is_some_and(|data| self.offer(TapMessage::new(head, data.clone())))
    }
}

/// A function of the run time and the payload of a message.
pub(super) struct PayloadWatcher<F>(pub(super) F);

impl<F: FnMut(Time, &dyn Any) + Send> Listener for PayloadWatcher<F> {
    fn hear(&mut self, head: &Head, payload: &dyn Any) -> bool {
        (self.0)(head.at, payload);
        true
    }
}

/// The listeners of a topic.
#[derive(Default)]
pub(super) struct Listeners {
    /// Whether there are any, so that without them a message costs one load only.
    any: AtomicBool,
    all: Mutex<Vec<Box<dyn Listener>>>,
}

impl Listeners {
    pub(super) fn add(&self, listener: impl Listener + 'static) {
        lock(&self.all).push(Box::new(listener));
        self.any.store(true, Ordering::Release);
    }

    /// Hands a message to all, and removes those that are gone.
    #[inline]
    pub(super) fn hear(&self, head: &Head, payload: &dyn Any) {
        if self.any.load(Ordering::Acquire) {
            self.hand_out(head, payload);
        }
    }

    fn hand_out(&self, head: &Head, payload: &dyn Any) {
        let mut all = lock(&self.all);
        all.retain_mut(|listener| listener.hear(head, payload));
        self.any.store(!all.is_empty(), Ordering::Release);
    }
}
