//! The answer to exercise 11, for teachers: a named bus.

use std::{
    collections::VecDeque,
    sync::{Mutex, MutexGuard, PoisonError},
};

use crate::Message;

/// A named bus that keeps the newest messages.
#[derive(Debug)]
pub struct Topic<T> {
    name: String,
    depth: usize,
    queue: Mutex<Queue<T>>,
}

#[derive(Debug)]
struct Queue<T> {
    messages: VecDeque<Message<T>>,
    published: u64,
    /// Number of the first message that the subscriber has not caught up with.
    unread: u64,
    dropped: u64,
}

impl<T: Clone> Topic<T> {
    /// Creates an empty bus that keeps `depth` messages, at least one.
    pub fn new(name: &str, depth: usize) -> Self {
        Self {
            name: name.to_owned(),
            depth: depth.max(1),
            queue: Mutex::new(Queue {
                messages: VecDeque::new(),
                published: 0,
                unread: 0,
                dropped: 0,
            }),
        }
    }

    /// Returns the name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Publishes `data` at the time `stamp`.
    pub fn publish(&self, data: T, stamp: u64, origin: Option<u64>) {
        let mut queue = self.queue();
        if queue.messages.len() == self.depth
            && let Some(oldest) = queue.messages.pop_front()
            && oldest.seq >= queue.unread
        {
            queue.dropped += 1;
        }
        let seq = queue.published;
        queue.published += 1;
        queue.messages.push_back(Message {
            data,
            stamp,
            seq,
            origin,
        });
    }

    /// Returns the newest message.
    pub fn latest(&self) -> Option<Message<T>> {
        let mut queue = self.queue();
        queue.unread = queue.published;
        queue.messages.back().cloned()
    }

    /// Returns the number of messages published.
    pub fn published(&self) -> u64 {
        self.queue().published
    }

    /// Returns the number of messages dropped.
    pub fn dropped(&self) -> u64 {
        self.queue().dropped
    }

    fn queue(&self) -> MutexGuard<'_, Queue<T>> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
