//! The end of a topic that triggers a node.

use std::collections::VecDeque;

use super::{
    Bus, Queue, ReadMark, Subscription, Topic,
    message::{Message, Payload},
};
use crate::{
    sync::{Arc, atomic::Ordering},
    time::Time,
    trigger::{Arrival, Arrivals, Intake, TakenMessage},
};

/// What a queue keeps for the nodes that its messages trigger.
#[derive(Debug)]
pub(super) struct Triggers<T> {
    /// Run times of the deliveries of the messages in the queue.
    delivered: VecDeque<Time>,
    ends: Vec<TriggerEnd<T>>,
}

/// A subscription that triggers its node.
#[derive(Debug)]
struct TriggerEnd<T> {
    mark: Arc<ReadMark>,
    /// Index of the node, and number of the topic among those that trigger it.
    node: usize,
    input: usize,
    arrivals: Arc<Arrivals>,
    /// The messages that it has taken and that may still be read.
    taken: VecDeque<Message<T>>,
    /// The message that it reads.
    chosen: Option<Message<T>>,
}

impl<T> Triggers<T> {
    /// Adds the delivery of the newest message.
    pub(super) fn push(&mut self, at: Time) {
        self.delivered.push_back(at);
    }

    /// Removes the delivery of the oldest message.
    pub(super) fn evict(&mut self) {
        self.delivered.pop_front();
    }

    /// Announces a message that will arrive at run time `at`.
    pub(super) fn announce(&self, at: Time) {
        for (end, arrival) in self.ends.iter().zip(self.arrivals(at)) {
            end.arrivals.add(arrival);
        }
    }

    /// The arrivals of a message at run time `at`.
    pub(super) fn arrivals(&self, at: Time) -> impl Iterator<Item = Arrival> {
        let ends = self.ends.iter();
        ends.map(move |end| Arrival {
            at,
            node: end.node,
            input: end.input,
        })
    }

    /// The message that the subscription with this read position reads.
    pub(super) fn chosen(&self, mark: &Arc<ReadMark>) -> Option<&Message<T>> {
        self.end(mark)?.chosen.as_ref()
    }

    /// Whether the subscription with this read position triggers its node.
    pub(super) fn knows(&self, mark: &Arc<ReadMark>) -> bool {
        self.end(mark).is_some()
    }

    fn end(&self, mark: &Arc<ReadMark>) -> Option<&TriggerEnd<T>> {
        self.ends.iter().find(|end| Arc::ptr_eq(&end.mark, mark))
    }
}

impl<T: Payload> Topic<T> {
    /// Creates a subscription whose messages trigger the node with index `node`, as its
    /// input number `input` and the topic's reader number `reader`.
    pub(crate) fn trigger(
        &self,
        node: usize,
        input: usize,
        reader: usize,
        arrivals: &Arc<Arrivals>,
    ) -> (Subscription<T>, Box<dyn Intake>) {
        let mut subscription = self.subscribe_as(Some(reader));
        subscription.triggers = true;
        let mark = subscription.mark();
        let mut turn = self.0.queue.peek();
        let queue = &mut *turn;
        let delivered = queue.messages.iter().map(|message| message.stamp);
        let triggers = queue.triggers.get_or_insert_with(|| {
            Box::new(Triggers {
                delivered: delivered.collect(),
                ends: Vec::new(),
            })
        });
        triggers.ends.push(TriggerEnd {
            mark: mark.clone(),
            node,
            input,
            arrivals: arrivals.clone(),
            taken: VecDeque::new(),
            chosen: None,
        });
        drop(turn);
        let bus = self.0.clone();
        (subscription, Box::new(IntakeEnd { bus, mark }))
    }
}

/// The end of a topic by which its messages are taken.
struct IntakeEnd<T> {
    bus: Arc<Bus<T>>,
    mark: Arc<ReadMark>,
}

impl<T> Queue<T> {
    /// Index of the oldest message after the read position, and its delivery.
    fn unread(&self, mark: &ReadMark) -> Option<(usize, Time)> {
        let next = mark.next_unread.load(Ordering::Relaxed);
        let index = self.messages.partition_point(|message| message.seq < next);
        let at = self.triggers.as_ref()?.delivered.get(index)?;
        Some((index, *at))
    }

    fn end(&mut self, mark: &Arc<ReadMark>) -> Option<&mut TriggerEnd<T>> {
        let ends = self.triggers.as_mut()?.ends.iter_mut();
        ends.into_iter().find(|end| Arc::ptr_eq(&end.mark, mark))
    }
}

impl<T: Payload> Intake for IntakeEnd<T> {
    fn oldest(&self, now: Time) -> Option<Time> {
        let mut turn = self.bus.queue.lock();
        let queue = &mut *turn;
        queue.deliver(now);
        queue.unread(&self.mark).map(|(_, at)| at)
    }

    fn waiting(&self, now: Time) -> usize {
        let mut turn = self.bus.queue.lock();
        let queue = &mut *turn;
        queue.deliver(now);
        let first = queue.unread(&self.mark).map(|(index, _)| index);
        first.map_or(0, |first| queue.messages.len() - first)
    }

    fn take(&mut self, now: Time) -> Option<TakenMessage> {
        let mut turn = self.bus.queue.lock();
        let queue = &mut *turn;
        queue.deliver(now);
        let (index, arrived) = queue.unread(&self.mark)?;
        let message = queue.messages.get(index)?.clone();
        let taken = TakenMessage {
            seq: message.seq,
            sensed: message.sensed(),
            arrived,
        };
        self.mark
            .next_unread
            .store(message.seq + 1, Ordering::Relaxed);
        queue.end(&self.mark)?.taken.push_back(message);
        Some(taken)
    }

    fn choose(&mut self, seq: u64) {
        let mut turn = self.bus.queue.lock();
        if let Some(end) = turn.end(&self.mark) {
            let mut taken = end.taken.iter();
            end.chosen = taken.find(|message| message.seq == seq).cloned();
        }
    }

    fn forget_before(&mut self, seq: Option<u64>) {
        let mut turn = self.bus.queue.lock();
        if let Some(end) = turn.end(&self.mark) {
            let kept = seq.unwrap_or(u64::MAX);
            end.taken.retain(|message| message.seq >= kept);
        }
    }
}

impl<T> Drop for IntakeEnd<T> {
    fn drop(&mut self) {
        if let Some(triggers) = &mut self.bus.queue.lock().triggers {
            triggers
                .ends
                .retain(|end| !Arc::ptr_eq(&end.mark, &self.mark));
        }
    }
}
